"""Compiled inner loops over blocks of frames.

A block holds B frames with the frames innermost, ``(V, 3, B)``: every operator then streams over contiguous memory
and the compiler vectorises over the frames. All of them release the interpreter lock, so blocks can run on threads.

The compiler vectorises a loop only if it can rule out, with a few comparisons, that what is written is read again. So
loops are short and write one thing each, into small work arrays that stay in the cache.
"""

from __future__ import annotations

import numpy as np

from toolkit.compiled import njit

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
# Vertices that are copied frame by frame together, so that whole cache lines are written.
_TILE = 64
# Vectors whose local frames are worked out together: enough for long loops, few enough for the first cache.
_TOGETHER = 128


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
def place_frames(points, shift, position, rotations, translations, scale, out):
    """Sum, put the rigid motion on and renumber: ``out[b, v] = scale R_b (points + shift)[position[v], :, b] + t_b``.

    ``points`` and ``shift`` (V, 3, B), ``rotations`` (B, 3, 3) and ``translations`` (B, 3) float32, ``out`` (B, V, 3).
    """
    n_vertices, _, n_frames = points.shape
    turn, start = np.empty((3, 3, n_frames), points.dtype), np.empty((3, n_frames), points.dtype)
    x, moved = np.empty((3, n_frames), points.dtype), np.empty((_TILE, 3, n_frames), points.dtype)
    for b in range(n_frames):
        for k in range(3):
            start[k, b] = translations[b, k]
            for i in range(3):
                turn[k, i, b] = scale * rotations[b, k, i]
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        for v in range(first, last):
            p = position[v]
            for i in range(3):
                for b in range(n_frames):
                    x[i, b] = points[p, i, b] + shift[p, i, b]
            for k in range(3):
                for b in range(n_frames):
                    turned = turn[k, 0, b] * x[0, b] + turn[k, 1, b] * x[1, b] + turn[k, 2, b] * x[2, b]
                    moved[v - first, k, b] = turned + start[k, b]
        for b in range(n_frames):
            for v in range(first, last):
                for k in range(3):
                    out[b, v, k] = moved[v - first, k, b]


@njit(**_OPTIONS)
def _average_rows(starts, neighbours, share, own, first, last, current, coefficient, block, total, previous):
    """Rows ``first <= i < last`` of ``previous <- coefficient block + own current - share A current - previous``.

    Four neighbours at a time: ``total`` is then read and written a quarter as often.
    """
    n_columns = len(total)
    for i in range(first, last):
        p, stop = starts[i], starts[i + 1]
        if p + 4 <= stop:
            j, k, m, n = neighbours[p], neighbours[p + 1], neighbours[p + 2], neighbours[p + 3]
            for c in range(n_columns):
                total[c] = (current[j, c] + current[k, c]) + (current[m, c] + current[n, c])
            p += 4
        else:
            total[:] = 0
        while p + 4 <= stop:
            j, k, m, n = neighbours[p], neighbours[p + 1], neighbours[p + 2], neighbours[p + 3]
            for c in range(n_columns):
                total[c] += (current[j, c] + current[k, c]) + (current[m, c] + current[n, c])
            p += 4
        while p < stop:
            j = neighbours[p]
            for c in range(n_columns):
                total[c] += current[j, c]
            p += 1
        s = share[i]
        for c in range(n_columns):
            previous[i, c] = coefficient * block[i, c] + own * current[i, c] - s * total[c] - previous[i, c]


@njit(**_OPTIONS)
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
    total = np.empty(block.shape[1], block.dtype)
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
                _average_rows(starts, neighbours, weight, at, first, last, read, coefficients[k], block, total, write)
        done += steps


@njit(**_OPTIONS)
def _accumulate_normals(points, triangles, normals):
    """Area-weighted normals (not normalised) of every vertex in every frame; all arrays ``(V, 3, B)``."""
    n_vertices, _, n_frames = points.shape
    width = 3 * n_frames
    rows, sums = points.reshape(n_vertices, width), normals.reshape(n_vertices, width)
    sums[:] = 0
    u, v = np.empty((3, n_frames), points.dtype), np.empty((3, n_frames), points.dtype)
    cross = np.empty((3, n_frames), points.dtype)
    u_row, v_row, cross_row = u.reshape(width), v.reshape(width), cross.reshape(width)
    for f in range(len(triangles)):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        for c in range(width):
            u_row[c] = rows[j, c] - rows[i, c]
        for c in range(width):
            v_row[c] = rows[k, c] - rows[i, c]
        _cross(u, v, cross)
        for c in range(width):
            sums[i, c] += cross_row[c]
        for c in range(width):
            sums[j, c] += cross_row[c]
        for c in range(width):
            sums[k, c] += cross_row[c]


@njit(**_OPTIONS)
def _cross(a, b, out):
    """Cross products of vectors (3, n)."""
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        for t in range(a.shape[1]):
            out[k, t] = a[i, t] * b[j, t] - a[j, t] * b[i, t]


@njit(**_OPTIONS)
def _normalise(a, length):
    """Vectors (3, n) to unit length; ``length`` (n,) is scratch."""
    tiny, one = np.float32(1e-20), np.float32(1)
    for t in range(len(length)):
        length[t] = one / max(np.sqrt(a[0, t] * a[0, t] + a[1, t] * a[1, t] + a[2, t] * a[2, t]), tiny)
    for k in range(3):
        for t in range(len(length)):
            a[k, t] *= length[t]


@njit(**_OPTIONS)
def _work_array(points):
    """Room for one vector a frame, for as many vertices as are worked on together, (3, n, B)."""
    return np.zeros((3, max(1, _TOGETHER // points.shape[2]), points.shape[2]), points.dtype)


@njit(**_OPTIONS)
def _frames_at(points, normals, neighbour, first, last, tangent, bitangent, normal):
    """Local frames of vertices ``first <= v < last`` in all frames of the block, (3, n, B) each."""
    n_frames = points.shape[2]
    for v in range(first, last):
        w, i = neighbour[v], v - first
        for k in range(3):
            for t in range(n_frames):
                normal[k, i, t] = normals[v, k, t]
            for t in range(n_frames):
                tangent[k, i, t] = points[w, k, t] - points[v, k, t]
    n = normal.size // 3
    flat_tangent, flat_normal, scratch = tangent.reshape(3, n), normal.reshape(3, n), bitangent.reshape(3, n)[0]
    _normalise(flat_normal, scratch)
    _dot(flat_tangent, flat_normal, scratch)
    for k in range(3):
        for t in range(n):
            flat_tangent[k, t] -= scratch[t] * flat_normal[k, t]
    _normalise(flat_tangent, scratch)
    _cross(flat_normal, flat_tangent, bitangent.reshape(3, n))


@njit(**_OPTIONS)
def _dot(a, b, out):
    """Dot products (n,) of vectors (3, n)."""
    for t in range(len(out)):
        out[t] = a[0, t] * b[0, t] + a[1, t] * b[1, t] + a[2, t] * b[2, t]


@njit(**_OPTIONS)
def take_details(points, triangles, neighbour, normals, smooth, rest_offset, rest_detail, delta):
    """Turn deltas into motion details, in place: ``d = F^T (delta - smooth + rest_offset) - e_0`` (method 3, Eq. 3).

    ``points`` (V, 3, B) are smoothed, ``smooth`` and ``delta`` (V, 3, B) the smoothed and the full change since rest,
    ``rest_offset`` and ``rest_detail`` (V, 3) the rest shape's detail, plain and in its local frames; ``normals``
    (V, 3, B) is scratch.
    """
    _accumulate_normals(points, triangles, normals)
    n_vertices, _, n_frames = points.shape
    tangent, bitangent, normal = _work_array(points), _work_array(points), _work_array(points)
    x, along = _work_array(points), _work_array(points)
    together = x.shape[1]
    n = together * n_frames
    flat_x, flat_along = x.reshape(3, n), along.reshape(3, n)
    for first in range(0, n_vertices, together):
        last = min(n_vertices, first + together)
        _frames_at(points, normals, neighbour, first, last, tangent, bitangent, normal)
        for v in range(first, last):
            i = v - first
            for k in range(3):
                offset = rest_offset[v, k]
                for t in range(n_frames):
                    x[k, i, t] = delta[v, k, t] - smooth[v, k, t] + offset
        _dot(tangent.reshape(3, n), flat_x, flat_along[0])
        _dot(bitangent.reshape(3, n), flat_x, flat_along[1])
        _dot(normal.reshape(3, n), flat_x, flat_along[2])
        for v in range(first, last):
            i = v - first
            for k in range(3):
                own = rest_detail[v, k]
                for t in range(n_frames):
                    delta[v, k, t] = along[k, i, t] - own


@njit(**_OPTIONS)
def rotate_details(points, triangles, neighbour, normals, details, order, gain, rest_detail, out):
    """Turn local details into displacements of the frame: ``out = F (e_0 + gain d)`` (method 7, Eqs. 5 and 16).

    ``points`` and ``out`` (V, 3, B); ``details`` (B, V, 3) in the original numbering, ``order`` (V,) old ids in new
    order; ``gain`` (V,), ``rest_detail`` (V, 3); ``normals`` is scratch.
    """
    _accumulate_normals(points, triangles, normals)
    n_vertices, _, n_frames = points.shape
    tangent, bitangent, normal = _work_array(points), _work_array(points), _work_array(points)
    x = _work_array(points)
    together = x.shape[1]
    for first in range(0, n_vertices, together):
        last = min(n_vertices, first + together)
        _frames_at(points, normals, neighbour, first, last, tangent, bitangent, normal)
        for v in range(first, last):
            i, old, g = v - first, order[v], gain[v]
            for t in range(n_frames):
                for k in range(3):
                    x[k, i, t] = g * details[t, old, k] + rest_detail[v, k]
        for v in range(first, last):
            i = v - first
            for k in range(3):
                for t in range(n_frames):
                    turned = tangent[k, i, t] * x[0, i, t] + bitangent[k, i, t] * x[1, i, t]
                    out[v, k, t] = turned + normal[k, i, t] * x[2, i, t]


@njit(**_OPTIONS)
def block_frames(points, triangles, neighbour):
    """Local frames ``(V, 3, 3, B)`` of a block, columns (tangent, bitangent, normal); see `local_frames`."""
    n_vertices, _, n_frames = points.shape
    normals = np.empty_like(points)
    _accumulate_normals(points, triangles, normals)
    frames = np.empty((n_vertices, 3, 3, n_frames), points.dtype)
    tangent, bitangent, normal = _work_array(points), _work_array(points), _work_array(points)
    together = normal.shape[1]
    for first in range(0, n_vertices, together):
        last = min(n_vertices, first + together)
        _frames_at(points, normals, neighbour, first, last, tangent, bitangent, normal)
        for v in range(first, last):
            i = v - first
            for k in range(3):
                for t in range(n_frames):
                    frames[v, k, 0, t], frames[v, k, 1, t] = tangent[k, i, t], bitangent[k, i, t]
                    frames[v, k, 2, t] = normal[k, i, t]
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
