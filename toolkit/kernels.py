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
    "edge_frames",
    "frames_to_block",
    "keep_largest_change",
    "place_frames",
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
def frames_to_block(frames, order, rotations, translations, rest, out):
    """Undo each frame's rigid motion, renumber and subtract the rest: ``out[v, :, b] = R_b^T (x_b - t_b) - rest``.

    ``frames`` (B, V, 3), ``order`` (V,) old ids in new order, ``rotations`` (B, 3, 3) and ``translations`` (B, 3) of
    the head, ``rest`` (V, 3) renumbered, ``out`` (V, 3, B). In float64 up to the difference.
    """
    n_frames, n_vertices = frames.shape[0], frames.shape[1]
    turn, shift, x = np.zeros((3, 3, n_frames)), np.zeros((3, n_frames)), np.empty((3, n_frames))
    for b in range(n_frames):
        for k in range(3):
            for i in range(3):
                # The inverse of a rotation is its transpose.
                turn[k, i, b] = rotations[b, i, k]
                shift[k, b] += rotations[b, i, k] * translations[b, i]
    for v in range(n_vertices):
        old = order[v]
        for b in range(n_frames):
            for i in range(3):
                x[i, b] = frames[b, old, i]
        for k in range(3):
            place = rest[v, k]
            for b in range(n_frames):
                moved = turn[k, 0, b] * x[0, b] + turn[k, 1, b] * x[1, b] + turn[k, 2, b] * x[2, b]
                out[v, k, b] = moved - (shift[k, b] + place)


@njit(**_OPTIONS)
def block_to_frames(block, position, out):
    """Give a block ``(V, 3, B)`` its original numbering back: ``out[b, v] = block[position[v], :, b]``."""
    n_vertices, _, n_frames = block.shape
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        for b in range(n_frames):
            for v in range(first, last):
                for k in range(3):
                    out[b, v, k] = block[position[v], k, b]


@njit(**_OPTIONS)
def place_frames(points, shift, position, turns, translations, out):
    """Sum, move and renumber: ``out[b, v] = turns_b (points + shift)[position[v], :, b] + translations_b``.

    ``points`` and ``shift`` (V, 3, B), ``turns`` (B, 3, 3) and ``translations`` (B, 3) float32, ``out`` (B, V, 3).
    """
    n_vertices, _, n_frames = points.shape
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        for b in range(n_frames):
            turn, start = turns[b], translations[b]
            for v in range(first, last):
                p = position[v]
                x, y, z = points[p, 0, b], points[p, 1, b], points[p, 2, b]
                x, y, z = x + shift[p, 0, b], y + shift[p, 1, b], z + shift[p, 2, b]
                for k in range(3):
                    out[b, v, k] = turn[k, 0] * x + turn[k, 1] * y + turn[k, 2] * z + start[k]


@njit(**_ARITHMETIC)
def _average_rows(starts, neighbours, share, own, first, last, current, coefficient, block, previous):
    """Rows ``first <= i < last`` of ``previous <- coefficient block + own current - share A current - previous``.

    Four neighbours at a time: what is written is then read again a quarter as often.
    """
    n_columns = block.shape[1]
    for i in range(first, last):
        p, stop, s = starts[i], starts[i + 1], share[i]
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
    # Chosen so that the last step writes to ``out``.
    current, previous = (out, spare) if degree % 2 == 0 else (spare, out)
    for i in range(n_rows):
        for c in range(block.shape[1]):
            current[i, c] = coefficients[degree] * block[i, c]
            previous[i, c] = 0
    double = share + share
    n_chunks = (n_rows + bandwidth - 1) // bandwidth
    done = 0
    while done < degree:
        steps = min(depth, degree - done)
        for front in range(n_chunks + steps - 1):
            for step in range(max(0, front - n_chunks + 1), min(steps, front + 1)):
                first = (front - step) * bandwidth
                last = min(n_rows, first + bandwidth)
                k = degree - 1 - done - step
                # Not swapped but chosen, since the steps of a front alternate.
                read, write = (current, previous) if (done + step) % 2 == 0 else (previous, current)
                weight, at = (share, own) if k == 0 else (double, own + own)
                _average_rows(starts, neighbours, weight, at, first, last, read, coefficients[k], block, write)
        done += steps


@njit(**_ARITHMETIC)
def _accumulate_normals(points, triangles, normals):
    """Area-weighted normals (not normalised) of every vertex in every frame; all arrays ``(V, 3, B)``."""
    normals[:] = 0
    for f in range(len(triangles)):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        for t in range(points.shape[2]):
            ux, uy, uz = (
                points[j, 0, t] - points[i, 0, t],
                points[j, 1, t] - points[i, 1, t],
                points[j, 2, t] - points[i, 2, t],
            )
            vx, vy, vz = (
                points[k, 0, t] - points[i, 0, t],
                points[k, 1, t] - points[i, 1, t],
                points[k, 2, t] - points[i, 2, t],
            )
            x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            for v in (i, j, k):
                normals[v, 0, t] += x
                normals[v, 1, t] += y
                normals[v, 2, t] += z


@njit(forceinline=True, **_OPTIONS)
def _unit(x, y, z):
    one, tiny = np.float32(1), np.float32(1e-20)
    scale = one / max(np.sqrt(x * x + y * y + z * z), tiny)
    return x * scale, y * scale, z * scale


@njit(forceinline=True, **_OPTIONS)
def _local_frame(points, normals, v, w, t):
    """Tangent, towards the neighbour ``w``, bitangent and normal of vertex ``v`` in frame ``t``: nine numbers."""
    nx, ny, nz = _unit(normals[v, 0, t], normals[v, 1, t], normals[v, 2, t])
    tx, ty, tz = points[w, 0, t] - points[v, 0, t], points[w, 1, t] - points[v, 1, t], points[w, 2, t] - points[v, 2, t]
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = _unit(tx - along * nx, ty - along * ny, tz - along * nz)
    return tx, ty, tz, ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx, nx, ny, nz


@njit(**_ARITHMETIC)
def take_details(points, triangles, neighbour, normals, smooth, delta, rest_offset, rest_detail, out):
    """Turn deltas into motion details, ``d = F^T (delta - smooth + rest_offset) - e_0`` (method 3, Eq. 3).

    ``points`` (V, 3, B) are smoothed, ``smooth`` and ``delta`` (V, 3, B) the smoothed and the full change since rest,
    ``rest_offset`` and ``rest_detail`` (V, 3) the rest shape's detail, plain and in its local frames; ``normals``
    (V, 3, B) is scratch.
    """
    _accumulate_normals(points, triangles, normals)
    for v in range(len(points)):
        w = neighbour[v]
        ox, oy, oz = rest_offset[v, 0], rest_offset[v, 1], rest_offset[v, 2]
        ex, ey, ez = rest_detail[v, 0], rest_detail[v, 1], rest_detail[v, 2]
        for t in range(points.shape[2]):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _local_frame(points, normals, v, w, t)
            x = delta[v, 0, t] - smooth[v, 0, t] + ox
            y = delta[v, 1, t] - smooth[v, 1, t] + oy
            z = delta[v, 2, t] - smooth[v, 2, t] + oz
            out[v, 0, t] = tx * x + ty * y + tz * z - ex
            out[v, 1, t] = bx * x + by * y + bz * z - ey
            out[v, 2, t] = nx * x + ny * y + nz * z - ez


@njit(**_ARITHMETIC)
def rotate_details(points, triangles, neighbour, normals, details, order, gain, rest_detail, out):
    """Turn local details into displacements of the frame: ``out = F (e_0 + gain d)`` (method 7, Eqs. 5 and 16).

    ``points`` and ``out`` (V, 3, B); ``details`` (B, V, 3) in the original numbering, ``order`` (V,) old ids in new
    order; ``gain`` (V,), ``rest_detail`` (V, 3); ``normals`` is scratch.
    """
    _accumulate_normals(points, triangles, normals)
    for v in range(len(points)):
        w, old, g = neighbour[v], order[v], gain[v]
        ex, ey, ez = rest_detail[v, 0], rest_detail[v, 1], rest_detail[v, 2]
        for t in range(points.shape[2]):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _local_frame(points, normals, v, w, t)
            x, y, z = g * details[t, old, 0] + ex, g * details[t, old, 1] + ey, g * details[t, old, 2] + ez
            out[v, 0, t] = tx * x + bx * y + nx * z
            out[v, 1, t] = ty * x + by * y + ny * z
            out[v, 2, t] = tz * x + bz * y + nz * z


@njit(**_OPTIONS)
def block_frames(points, triangles, neighbour):
    """Local frames ``(V, 3, 3, B)`` of a block, columns (tangent, bitangent, normal); see `local_frames`."""
    n_vertices, _, n_frames = points.shape
    normals = np.empty_like(points)
    _accumulate_normals(points, triangles, normals)
    frames = np.empty((n_vertices, 3, 3, n_frames), points.dtype)
    for v in range(n_vertices):
        for t in range(n_frames):
            columns = _local_frame(points, normals, v, neighbour[v], t)
            for k in range(3):
                for i in range(3):
                    frames[v, i, k, t] = columns[3 * k + i]
    return frames


@njit(**_OPTIONS)
def edge_frames(vertices, triangles, out):
    """``[e0 e1 n]`` of every triangle, as columns, ``out`` (F, 3, 3); ``n = e0 x e1 / sqrt(|e0 x e1|)``."""
    for f in range(len(triangles)):
        _edge_frame(vertices, triangles, f, out[f])


@njit(**_OPTIONS)
def _edge_frame(vertices, triangles, f, out):
    a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
    for k in range(3):
        out[k, 0], out[k, 1] = vertices[b, k] - vertices[a, k], vertices[c, k] - vertices[a, k]
    squared = 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[k, 2] = out[i, 0] * out[j, 1] - out[j, 0] * out[i, 1]
        squared += out[k, 2] ** 2
    root = np.sqrt(max(np.sqrt(squared), 1e-300))
    for k in range(3):
        out[k, 2] /= root


@njit(**_OPTIONS)
def keep_largest_change(vertices, triangles, inverse, largest):
    """``largest <- max(largest, |[e0 e1 n] inverse - I|^2)`` (F,), Frobenius norm; ``inverse`` (F, 3, 3)."""
    frame = np.empty((3, 3))
    for f in range(len(triangles)):
        _edge_frame(vertices, triangles, f, frame)
        total = 0.0
        for i in range(3):
            for j in range(3):
                change = -1.0 if i == j else 0.0
                for k in range(3):
                    change += frame[i, k] * inverse[f, k, j]
                total += change**2
        largest[f] = max(largest[f], total)
