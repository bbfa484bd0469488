"""Compiled inner loops over blocks of frames.

A block holds B frames with the frames innermost, ``(V, 3, B)``: every operator then streams over contiguous memory
and the compiler vectorises over the frames. All of them release the interpreter lock, so blocks can run on threads.
"""

from __future__ import annotations

import numpy as np
from numba import njit

__all__ = [
    "add_head_motion",
    "average_step",
    "block_frames",
    "block_to_frames",
    "frames_to_block",
    "rotate_details",
    "take_details",
]

_OPTIONS = {"cache": True, "nogil": True, "fastmath": False, "boundscheck": False}


@njit(**_OPTIONS)
def frames_to_block(frames, order, rotations, translations, rest, out):
    """Undo each frame's rigid motion, renumber and subtract the rest: ``out[v, :, b] = R_b (x_b - t_b) - rest``.

    ``frames`` (B, V, 3), ``order`` (V,) old ids in new order, ``rotations`` (B, 3, 3) and ``translations`` (B, 3) of
    the head, ``rest`` (V, 3) renumbered, ``out`` (V, 3, B).
    """
    n_frames, n_vertices = frames.shape[0], frames.shape[1]
    for v in range(n_vertices):
        old = order[v]
        for b in range(n_frames):
            x = frames[b, old, 0] - translations[b, 0]
            y = frames[b, old, 1] - translations[b, 1]
            z = frames[b, old, 2] - translations[b, 2]
            for k in range(3):
                # The inverse of a rotation is its transpose.
                moved = rotations[b, 0, k] * x + rotations[b, 1, k] * y + rotations[b, 2, k] * z
                out[v, k, b] = moved - rest[v, k]


@njit(**_OPTIONS)
def block_to_frames(block, order, out):
    """Give a block ``(V, 3, B)`` its original numbering back: ``out`` (B, V, 3)."""
    n_vertices, _, n_frames = block.shape
    for v in range(n_vertices):
        old = order[v]
        for b in range(n_frames):
            for k in range(3):
                out[b, old, k] = block[v, k, b]


@njit(**_OPTIONS)
def average_step(indptr, indices, weights, current, previous, coefficient, result, first):
    """One step of Chebyshev's recurrence with the operator ``-W``, in place.

    ``previous <- -2 W current - previous`` (``-W current`` in the first step), ``result += coefficient * previous``.
    ``indptr, indices, weights`` are W in CSR form; the arrays are ``(V, C)``.
    """
    n_rows, n_columns = current.shape
    total = np.empty(n_columns, current.dtype)
    for i in range(n_rows):
        total[:] = 0
        for p in range(indptr[i], indptr[i + 1]):
            j = indices[p]
            weight = weights[p]
            for c in range(n_columns):
                total[c] += weight * current[j, c]
        if first:
            for c in range(n_columns):
                value = -total[c]
                previous[i, c] = value
                result[i, c] += coefficient * value
        else:
            for c in range(n_columns):
                value = -total[c] - total[c] - previous[i, c]
                previous[i, c] = value
                result[i, c] += coefficient * value


@njit(**_OPTIONS)
def _accumulate_normals(points, triangles, normals):
    """Area-weighted normals (not normalised) of every vertex in every frame; all arrays ``(V, 3, B)``."""
    n_frames = points.shape[2]
    normals[:] = 0
    for f in range(triangles.shape[0]):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        for b in range(n_frames):
            ux, uy, uz = (
                points[j, 0, b] - points[i, 0, b],
                points[j, 1, b] - points[i, 1, b],
                points[j, 2, b] - points[i, 2, b],
            )
            vx, vy, vz = (
                points[k, 0, b] - points[i, 0, b],
                points[k, 1, b] - points[i, 1, b],
                points[k, 2, b] - points[i, 2, b],
            )
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            normals[i, 0, b] += nx
            normals[i, 1, b] += ny
            normals[i, 2, b] += nz
            normals[j, 0, b] += nx
            normals[j, 1, b] += ny
            normals[j, 2, b] += nz
            normals[k, 0, b] += nx
            normals[k, 1, b] += ny
            normals[k, 2, b] += nz


@njit(**_OPTIONS)
def _frame_at(points, normals, neighbour, v, b):
    """Tangent, bitangent and normal of vertex v in frame b, as nine numbers."""
    tiny = np.float32(1e-20)
    nx, ny, nz = normals[v, 0, b], normals[v, 1, b], normals[v, 2, b]
    scale = np.float32(1) / max(np.sqrt(nx * nx + ny * ny + nz * nz), tiny)
    nx, ny, nz = nx * scale, ny * scale, nz * scale
    w = neighbour[v]
    ex, ey, ez = (
        points[w, 0, b] - points[v, 0, b],
        points[w, 1, b] - points[v, 1, b],
        points[w, 2, b] - points[v, 2, b],
    )
    along = ex * nx + ey * ny + ez * nz
    ex, ey, ez = ex - along * nx, ey - along * ny, ez - along * nz
    scale = np.float32(1) / max(np.sqrt(ex * ex + ey * ey + ez * ez), tiny)
    ex, ey, ez = ex * scale, ey * scale, ez * scale
    return ex, ey, ez, ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex, nx, ny, nz


@njit(**_OPTIONS)
def take_details(points, triangles, neighbour, normals, displacement, rest_detail):
    """Turn displacements into motion details, in place: ``d = F^T displacement - e_0`` (method 3, Eq. 3).

    ``points`` and ``displacement`` (V, 3, B), ``normals`` scratch of the same shape, ``rest_detail`` (V, 3).
    """
    _accumulate_normals(points, triangles, normals)
    for v in range(points.shape[0]):
        for b in range(points.shape[2]):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _frame_at(points, normals, neighbour, v, b)
            x, y, z = displacement[v, 0, b], displacement[v, 1, b], displacement[v, 2, b]
            displacement[v, 0, b] = tx * x + ty * y + tz * z - rest_detail[v, 0]
            displacement[v, 1, b] = bx * x + by * y + bz * z - rest_detail[v, 1]
            displacement[v, 2, b] = nx * x + ny * y + nz * z - rest_detail[v, 2]


@njit(**_OPTIONS)
def rotate_details(points, triangles, neighbour, normals, details, gain, rest_detail, out):
    """Turn local details into displacements of the frame: ``out = F (e_0 + gain d)`` (method 7, Eqs. 5 and 16).

    ``points``, ``details`` and ``out`` (V, 3, B), ``gain`` (V,), ``rest_detail`` (V, 3); ``normals`` is scratch.
    """
    _accumulate_normals(points, triangles, normals)
    for v in range(points.shape[0]):
        g = gain[v]
        for b in range(points.shape[2]):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _frame_at(points, normals, neighbour, v, b)
            x = rest_detail[v, 0] + g * details[v, 0, b]
            y = rest_detail[v, 1] + g * details[v, 1, b]
            z = rest_detail[v, 2] + g * details[v, 2, b]
            out[v, 0, b] = tx * x + bx * y + nx * z
            out[v, 1, b] = ty * x + by * y + ny * z
            out[v, 2, b] = tz * x + bz * y + nz * z


@njit(**_OPTIONS)
def block_frames(points, triangles, neighbour):
    """Local frames ``(V, 3, 3, B)`` of a block, columns (tangent, bitangent, normal); see `local_frames`."""
    n_vertices, _, n_frames = points.shape
    normals = np.empty_like(points)
    _accumulate_normals(points, triangles, normals)
    frames = np.empty((n_vertices, 3, 3, n_frames), points.dtype)
    for v in range(n_vertices):
        for b in range(n_frames):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _frame_at(points, normals, neighbour, v, b)
            frames[v, 0, 0, b], frames[v, 1, 0, b], frames[v, 2, 0, b] = tx, ty, tz
            frames[v, 0, 1, b], frames[v, 1, 1, b], frames[v, 2, 1, b] = bx, by, bz
            frames[v, 0, 2, b], frames[v, 1, 2, b], frames[v, 2, 2, b] = nx, ny, nz
    return frames


@njit(**_OPTIONS)
def add_head_motion(points, rotations, translations, scale):
    """Put the rigid motion on, in place: ``x_b <- scale R_b x_b + t_b``; ``points`` (V, 3, B)."""
    for v in range(points.shape[0]):
        for b in range(points.shape[2]):
            x, y, z = points[v, 0, b], points[v, 1, b], points[v, 2, b]
            for k in range(3):
                turned = rotations[b, k, 0] * x + rotations[b, k, 1] * y + rotations[b, k, 2] * z
                points[v, k, b] = scale * turned + translations[b, k]
