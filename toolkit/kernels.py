"""Compiled inner loops over blocks of frames.

A block holds B frames with the frames innermost, ``(V, 3, B)``: every operator then streams over contiguous memory
and the compiler vectorises over the frames. All of them release the interpreter lock, so blocks can run on threads.
No two arrays that are given to one function may share memory.
"""

from __future__ import annotations

import numpy as np

from toolkit.compiled import DisjointArrays, njit

__all__ = [
    "block_frames",
    "block_to_frames",
    "chebyshev_of_average",
    "frames_to_block",
    "longest_in_plane",
    "opposite_edges",
    "place_block",
    "renumber_frames",
    "rotate_details",
    "take_details",
]

# "contract": a product and a sum in one instruction; the order of sums stays as it is written.
_OPTIONS = {"cache": True, "nogil": True, "fastmath": {"contract"}, "boundscheck": False, "error_model": "numpy"}
# Not for what only copies: vectorised, it gathers numbers one by one.
_ARITHMETIC = _OPTIONS | {"pipeline_class": DisjointArrays}
# Vertices that are copied frame by frame together, so that whole cache lines are written.
_TILE = 64


@njit(**_OPTIONS)
def _frames_to_tile(frames, first, last, tile):
    """``tile[v - first, :, b] = frames[b, v]`` for vertices ``first <= v < last``."""
    for b in range(frames.shape[0]):
        for v in range(first, last):
            for k in range(3):
                tile[v - first, k, b] = frames[b, v, k]


@njit(**_ARITHMETIC)
def _still_tile(tile, position, turns, shifts, rest, first, last, out):
    for v in range(first, last):
        x, p = tile[v - first], position[v]
        for k in range(3):
            place = rest[v, k]
            for b in range(out.shape[2]):
                moved = turns[k, 0, b] * x[0, b] + turns[k, 1, b] * x[1, b] + turns[k, 2, b] * x[2, b]
                out[p, k, b] = moved - (shifts[k, b] + place)


@njit(**_OPTIONS)
def frames_to_block(frames, position, turns, shifts, rest, out):
    """Move, renumber and subtract the rest: ``out[position[v], :, b] = turns_b frames[b, v] - shifts_b - rest[v]``.

    ``frames`` (B, V, 3), ``turns`` (3, 3, B), ``shifts`` (3, B), ``rest`` (V, 3), ``out`` (V, 3, B). In float64 up to
    the difference.
    """
    n_vertices = frames.shape[1]
    tile = np.empty((_TILE, 3, frames.shape[0]), frames.dtype)
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        _frames_to_tile(frames, first, last, tile)
        _still_tile(tile, position, turns, shifts, rest, first, last, out)


@njit(**_ARITHMETIC)
def renumber_frames(frames, position, out):
    """Make a block ``(V, 3, B)`` of frames (B, V, 3) as they are: ``out[position[v], :, b] = frames[b, v]``."""
    n_vertices = frames.shape[1]
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        for b in range(frames.shape[0]):
            for v in range(first, last):
                for k in range(3):
                    out[position[v], k, b] = frames[b, v, k]


@njit(**_ARITHMETIC)
def block_to_frames(block, position, out):
    """Give a block ``(V, 3, B)`` its original numbering back: ``out[b, v] = block[position[v], :, b]``."""
    n_vertices, _, n_frames = block.shape
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        for b in range(n_frames):
            for v in range(first, last):
                for k in range(3):
                    out[b, v, k] = block[position[v], k, b]


@njit(**_ARITHMETIC)
def place_block(points, shift, turns, starts, out):
    """Sum and move: ``out[v, :, b] = turns_b (points + shift)[v, :, b] + starts_b``.

    ``points``, ``shift`` and ``out`` (V, 3, B), ``turns`` (3, 3, B) and ``starts`` (3, B) float32.
    """
    for v in range(len(points)):
        for b in range(points.shape[2]):
            x, y, z = (
                points[v, 0, b] + shift[v, 0, b],
                points[v, 1, b] + shift[v, 1, b],
                points[v, 2, b] + shift[v, 2, b],
            )
            for k in range(3):
                out[v, k, b] = turns[k, 0, b] * x + turns[k, 1, b] * y + turns[k, 2, b] * z + starts[k, b]


@njit(**_ARITHMETIC)
def _first_rows(coefficient, first, last, block, current, previous):
    """Rows ``first <= i < last`` of the recurrence's beginning: ``current <- coefficient block``, ``previous <- 0``."""
    for i in range(first, last):
        for c in range(block.shape[1]):
            current[i, c] = coefficient * block[i, c]
            previous[i, c] = 0


@njit(**_ARITHMETIC)
def _average_rows(starts, neighbours, share, own, coefficient, first, last, block, current, previous):
    """Rows ``first <= i < last`` of ``previous <- coefficient block + own current - share A current - previous``.

    Four neighbours at a time: what is written is then read again a quarter as often.
    """
    n_columns = block.shape[1]
    for i in range(first, last):
        p, stop, s = starts[i], starts[i + 1], share[i]
        if p + 4 <= stop:
            j, k, m, n = neighbours[p], neighbours[p + 1], neighbours[p + 2], neighbours[p + 3]
            for c in range(n_columns):
                seen = (current[j, c] + current[k, c]) + (current[m, c] + current[n, c])
                previous[i, c] = coefficient * block[i, c] + own * current[i, c] - previous[i, c] - s * seen
            p += 4
        else:
            for c in range(n_columns):
                previous[i, c] = coefficient * block[i, c] + own * current[i, c] - previous[i, c]
        while p + 4 <= stop:
            j, k, m, n = neighbours[p], neighbours[p + 1], neighbours[p + 2], neighbours[p + 3]
            for c in range(n_columns):
                previous[i, c] -= s * ((current[j, c] + current[k, c]) + (current[m, c] + current[n, c]))
            p += 4
        while p < stop:
            j = neighbours[p]
            for c in range(n_columns):
                previous[i, c] -= s * current[j, c]
            p += 1


@njit(**_ARITHMETIC)
def chebyshev_of_average(starts, neighbours, share, own, coefficients, bandwidth, depth, block, out, spare):
    """``out <- sum_k c_k T_k(S) block`` (V, C) by Clenshaw's recurrence, ``S x = own x - share (sum over neighbours)``.

    ``neighbours[starts[i]:starts[i + 1]]`` are row i's, none further than ``bandwidth`` rows away; ``share`` (V,).
    ``b_k = c_k block + 2 S b_(k+1) - b_(k+2)``; ``out`` and ``spare`` do for all of them, as a row of ``b_(k+2)`` is
    last needed where ``b_k`` takes its place. ``depth`` steps go over the rows together, each a chunk of ``bandwidth``
    rows behind the step before it, so that a chunk is in the cache for all of them: memory is the bottleneck.
    """
    n_rows = len(block)
    degree = len(coefficients) - 1
    double = share + share
    n_chunks = (n_rows + bandwidth - 1) // bandwidth
    done = 0
    while done <= degree:
        steps = min(depth, degree + 1 - done)
        for front in range(n_chunks + steps - 1):
            for step in range(max(0, front - n_chunks + 1), min(steps, front + 1)):
                first = (front - step) * bandwidth
                last = min(n_rows, first + bandwidth)
                k = degree - done - step
                # Not swapped but chosen, since the steps of a front alternate; the last one writes to ``out``.
                read, write = (spare, out) if k % 2 == 0 else (out, spare)
                weight, at = (share, own) if k == 0 else (double, own + own)
                if k == degree:
                    _first_rows(coefficients[k], first, last, block, write, read)
                else:
                    _average_rows(starts, neighbours, weight, at, coefficients[k], first, last, block, read, write)
        done += steps


@njit(**_OPTIONS)
def opposite_edges(triangles, n_vertices):
    """The edges opposite to each vertex in its triangles: those of vertex v are ``edges[starts[v] : starts[v + 1]]``.

    ``starts`` (V + 1,) and ``edges`` (3F, 2), uint32; turned as their triangles are, and in their order.
    """
    starts, edges = np.zeros(n_vertices + 2, np.uint32), np.empty((3 * len(triangles), 2), np.uint32)
    for f in range(len(triangles)):
        for k in range(3):
            starts[triangles[f, k] + 2] += 1
    for v in range(n_vertices):
        starts[v + 2] += starts[v + 1]
    for f in range(len(triangles)):
        for k in range(3):
            at = starts[triangles[f, k] + 1]
            edges[at, 0], edges[at, 1] = triangles[f, (k + 1) % 3], triangles[f, (k + 2) % 3]
            starts[triangles[f, k] + 1] = at + 1
    return starts[:-1], edges


@njit(**_OPTIONS)
def longest_in_plane(vertices, starts, edges):
    """The neighbour of each vertex whose edge is longest in the tangent plane, ``(V,)``; the first of equal ones.

    ``vertices`` (V, 3) float64; ``starts`` and ``edges`` are the mesh's `opposite_edges`. A lone vertex has itself.
    """
    points, normal = vertices.reshape(-1, 3, 1), np.empty((3, 1))
    longest = np.arange(len(vertices))
    for v in range(len(vertices)):
        _sum_normals(points, starts, edges, v, normal)
        nx, ny, nz = _unit(normal[0, 0], normal[1, 0], normal[2, 0])
        best = -np.inf
        for e in range(starts[v], starts[v + 1]):
            for w in edges[e]:
                x, y, z = (
                    vertices[w, 0] - vertices[v, 0],
                    vertices[w, 1] - vertices[v, 1],
                    vertices[w, 2] - vertices[v, 2],
                )
                in_plane = x * x + y * y + z * z - (x * nx + y * ny + z * nz) ** 2
                if in_plane > best:
                    best, longest[v] = in_plane, w
    return longest


@njit(**_ARITHMETIC)
def _sum_normals(points, starts, edges, v, normal):
    """Area-weighted normal (not normalised) of vertex ``v`` in every frame, to ``normal`` (3, B)."""
    normal[:] = 0
    for e in range(starts[v], starts[v + 1]):
        i, j = edges[e, 0], edges[e, 1]
        for t in range(points.shape[2]):
            px, py, pz = points[v, 0, t], points[v, 1, t], points[v, 2, t]
            ux, uy, uz = points[i, 0, t] - px, points[i, 1, t] - py, points[i, 2, t] - pz
            vx, vy, vz = points[j, 0, t] - px, points[j, 1, t] - py, points[j, 2, t] - pz
            normal[0, t] += uy * vz - uz * vy
            normal[1, t] += uz * vx - ux * vz
            normal[2, t] += ux * vy - uy * vx


@njit(forceinline=True, **_OPTIONS)
def _unit(x, y, z):
    one, tiny = np.float32(1), np.float32(1e-20)
    scale = one / max(np.sqrt(x * x + y * y + z * z), tiny)
    return x * scale, y * scale, z * scale


@njit(forceinline=True, **_OPTIONS)
def _local_frame(points, normal, v, w, t):
    """Tangent, towards the neighbour ``w``, bitangent and normal of vertex ``v`` in frame ``t``: nine numbers."""
    nx, ny, nz = _unit(normal[0, t], normal[1, t], normal[2, t])
    tx, ty, tz = points[w, 0, t] - points[v, 0, t], points[w, 1, t] - points[v, 1, t], points[w, 2, t] - points[v, 2, t]
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = _unit(tx - along * nx, ty - along * ny, tz - along * nz)
    return tx, ty, tz, ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx, nx, ny, nz


@njit(**_ARITHMETIC)
def take_details(points, starts, edges, neighbour, smooth, delta, rest_offset, rest_detail, out):
    """Turn deltas into motion details, ``d = F^T (delta - smooth + rest_offset) - e_0`` (method 3, Eq. 3).

    ``points`` (V, 3, B) are smoothed, ``smooth`` and ``delta`` (V, 3, B) the smoothed and the full change since rest,
    ``rest_offset`` and ``rest_detail`` (V, 3) the rest shape's detail, plain and in its local frames; ``starts`` and
    ``edges`` are the mesh's `opposite_edges`.
    """
    normal = np.empty(points.shape[1:], points.dtype)
    for v in range(len(points)):
        _sum_normals(points, starts, edges, v, normal)
        w = neighbour[v]
        ox, oy, oz = rest_offset[v, 0], rest_offset[v, 1], rest_offset[v, 2]
        ex, ey, ez = rest_detail[v, 0], rest_detail[v, 1], rest_detail[v, 2]
        for t in range(points.shape[2]):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _local_frame(points, normal, v, w, t)
            x = delta[v, 0, t] - smooth[v, 0, t] + ox
            y = delta[v, 1, t] - smooth[v, 1, t] + oy
            z = delta[v, 2, t] - smooth[v, 2, t] + oz
            out[v, 0, t] = tx * x + ty * y + tz * z - ex
            out[v, 1, t] = bx * x + by * y + bz * z - ey
            out[v, 2, t] = nx * x + ny * y + nz * z - ez


@njit(**_ARITHMETIC)
def rotate_details(points, starts, edges, neighbour, details, gain, rest_detail, out):
    """Turn local details into displacements of the frame: ``out = F (e_0 + gain d)`` (method 7, Eqs. 5 and 16).

    ``points``, ``details`` and ``out`` (V, 3, B); ``gain`` (V,), ``rest_detail`` (V, 3); ``starts`` and ``edges`` are
    the mesh's `opposite_edges`.
    """
    normal = np.empty(points.shape[1:], points.dtype)
    for v in range(len(points)):
        _sum_normals(points, starts, edges, v, normal)
        w, g = neighbour[v], gain[v]
        ex, ey, ez = rest_detail[v, 0], rest_detail[v, 1], rest_detail[v, 2]
        for t in range(points.shape[2]):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _local_frame(points, normal, v, w, t)
            x, y, z = g * details[v, 0, t] + ex, g * details[v, 1, t] + ey, g * details[v, 2, t] + ez
            out[v, 0, t] = tx * x + bx * y + nx * z
            out[v, 1, t] = ty * x + by * y + ny * z
            out[v, 2, t] = tz * x + bz * y + nz * z


@njit(**_OPTIONS)
def block_frames(points, starts, edges, neighbour):
    """Local frames ``(V, 3, 3, B)`` of a block, columns (tangent, bitangent, normal); see `local_frames`."""
    n_vertices, _, n_frames = points.shape
    normal = np.empty(points.shape[1:], points.dtype)
    frames = np.empty((n_vertices, 3, 3, n_frames), points.dtype)
    for v in range(n_vertices):
        _sum_normals(points, starts, edges, v, normal)
        for t in range(n_frames):
            columns = _local_frame(points, normal, v, neighbour[v], t)
            for k in range(3):
                for i in range(3):
                    frames[v, i, k, t] = columns[3 * k + i]
    return frames
