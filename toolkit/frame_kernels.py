"""Compiled inner loops over blocks of frames: local frames, and details in them.

Blocks are those of `toolkit.kernels`, ``(V, 3, B)``. No two arrays that are given to one function may share memory.
"""

from __future__ import annotations

import numpy as np

from toolkit.compiled import ARITHMETIC, LOOPS, njit

__all__ = ["block_frames", "longest_in_plane", "opposite_edges", "rotate_details", "take_details"]


@njit(**LOOPS)
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


@njit(**LOOPS)
def longest_in_plane(vertices, starts, edges):
    """The neighbour of each vertex whose edge is longest in the tangent plane, ``(V,)``; the first of equal ones.

    ``vertices`` (V, 3) float64; ``starts`` and ``edges`` are the mesh's `opposite_edges`. A lone vertex has itself.
    """
    points = vertices.reshape(-1, 3, 1)
    longest = np.arange(len(vertices))
    for v in range(len(vertices)):
        nx, ny, nz = _unit(*_sum_normal(points, starts, edges, v))
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


@njit(forceinline=True, **LOOPS)
def _sum_normals(points, starts, edges, v, normal):
    """Area-weighted normal (not normalised) of vertex ``v`` in every frame, to ``normal`` (3, B)."""
    if points.shape[2] == 1:  # what is displayed: numbers by themselves take half the time
        normal[0, 0], normal[1, 0], normal[2, 0] = _sum_normal(points, starts, edges, v)
    else:
        _sum_in_frames(points, starts, edges, v, normal)


@njit(**ARITHMETIC)
def _sum_in_frames(points, starts, edges, v, normal):
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


@njit(forceinline=True, **LOOPS)
def _sum_normal(points, starts, edges, v):
    """The same in the first frame: three numbers."""
    px, py, pz = points[v, 0, 0], points[v, 1, 0], points[v, 2, 0]
    x = y = z = points.dtype.type(0)
    for e in range(starts[v], starts[v + 1]):
        i, j = edges[e, 0], edges[e, 1]
        ux, uy, uz = points[i, 0, 0] - px, points[i, 1, 0] - py, points[i, 2, 0] - pz
        vx, vy, vz = points[j, 0, 0] - px, points[j, 1, 0] - py, points[j, 2, 0] - pz
        x += uy * vz - uz * vy
        y += uz * vx - ux * vz
        z += ux * vy - uy * vx
    return x, y, z


@njit(forceinline=True, **LOOPS)
def _unit(x, y, z):
    one, tiny = np.float32(1), np.float32(1e-20)
    scale = one / max(np.sqrt(x * x + y * y + z * z), tiny)
    return x * scale, y * scale, z * scale


@njit(forceinline=True, **LOOPS)
def _local_frame(points, normal, v, w, t):
    """Tangent, towards the neighbour ``w``, bitangent and normal of vertex ``v`` in frame ``t``: nine numbers."""
    nx, ny, nz = _unit(normal[0, t], normal[1, t], normal[2, t])
    tx, ty, tz = points[w, 0, t] - points[v, 0, t], points[w, 1, t] - points[v, 1, t], points[w, 2, t] - points[v, 2, t]
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = _unit(tx - along * nx, ty - along * ny, tz - along * nz)
    return tx, ty, tz, ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx, nx, ny, nz


@njit(**ARITHMETIC)
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


@njit(**ARITHMETIC)
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


@njit(**LOOPS)
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
