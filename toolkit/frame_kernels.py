"""Compiled inner loops over blocks of frames: local frames, and details in them.

Blocks are those of `toolkit.kernels`, ``(V, 3, B)``. No two arrays that are given to one function may share memory.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import scratch
from toolkit.compiled import ARITHMETIC, LOOPS, helper, njit

__all__ = ["block_frames", "longest_in_plane", "opposite_edges", "rotate_details", "take_details"]

Block = NDArray[np.floating]
Ids = NDArray[np.integer]


def opposite_edges(triangles: Ids, n_vertices: int) -> tuple[Ids, Ids]:
    """The edges opposite to each vertex in its triangles: those of vertex v are ``edges[starts[v] : starts[v + 1]]``.

    ``starts`` (V + 1,) and ``edges`` (3F, 2), uint32; turned as their triangles are, and in their order.
    """
    starts, edges = np.zeros(n_vertices + 2, np.uint32), np.empty((3 * len(triangles), 2), np.uint32)
    _sort_edges(triangles, starts, edges)
    return starts[:-1], edges


@njit(**LOOPS)
def _sort_edges(triangles, starts, edges):
    """Counting sort by vertex; each start stands one place late until its edges are in."""
    for f in range(len(triangles)):
        for k in range(3):
            starts[triangles[f, k] + 2] += 1
    for v in range(2, len(starts)):
        starts[v] += starts[v - 1]
    for f in range(len(triangles)):
        for k in range(3):
            at = starts[triangles[f, k] + 1]
            edges[at, 0], edges[at, 1] = triangles[f, (k + 1) % 3], triangles[f, (k + 2) % 3]
            starts[triangles[f, k] + 1] = at + 1


def longest_in_plane(vertices: NDArray[np.float64], starts: Ids, edges: Ids) -> NDArray[np.int64]:
    """The neighbour of each vertex whose edge is longest in the tangent plane, ``(V,)``; the first of equal ones.

    ``vertices`` (V, 3) float64; ``starts`` and ``edges`` are the mesh's `opposite_edges`. A lone vertex has itself.
    """
    longest = np.arange(len(vertices))
    _find_longest(vertices[:, :, None], starts, edges, longest)
    return longest


@njit(**LOOPS)
def _find_longest(points, starts, edges, longest):
    for v in range(len(points)):
        nx, ny, nz = _unit(*_sum_normal(points, starts, edges, v, 0))
        best = -np.inf
        for e in range(starts[v], starts[v + 1]):
            for w in edges[e]:
                x, y, z = _minus(points, w, v, 0)
                along = x * nx + y * ny + z * nz
                in_plane = x * x + y * y + z * z - along * along
                if in_plane > best:
                    best, longest[v] = in_plane, w


@helper(forceinline=True, **LOOPS)
def _minus(points, i, j, t):
    return points[i, 0, t] - points[j, 0, t], points[i, 1, t] - points[j, 1, t], points[i, 2, t] - points[j, 2, t]


@helper(forceinline=True, **LOOPS)
def _sum_normals(points, starts, edges, v, normal):
    """Area-weighted normal (not normalised) of vertex ``v`` in every frame, to ``normal`` (3, B)."""
    if points.shape[2] == 1:  # what is displayed: numbers by themselves take half the time
        normal[0, 0], normal[1, 0], normal[2, 0] = _sum_normal(points, starts, edges, v, 0)
    else:
        _sum_in_frames(points, starts, edges, v, normal)


@helper(**ARITHMETIC)
def _sum_in_frames(points, starts, edges, v, normal):
    normal[:] = 0
    for e in range(starts[v], starts[v + 1]):
        i, j = edges[e, 0], edges[e, 1]
        for t in range(points.shape[2]):
            ux, uy, uz = _minus(points, i, v, t)
            vx, vy, vz = _minus(points, j, v, t)
            normal[0, t] += uy * vz - uz * vy
            normal[1, t] += uz * vx - ux * vz
            normal[2, t] += ux * vy - uy * vx


@helper(forceinline=True, **LOOPS)
def _sum_normal(points, starts, edges, v, t):
    """The same in frame ``t``: three numbers."""
    x = y = z = points.dtype.type(0)
    for e in range(starts[v], starts[v + 1]):
        i, j = edges[e, 0], edges[e, 1]
        ux, uy, uz = _minus(points, i, v, t)
        vx, vy, vz = _minus(points, j, v, t)
        x += uy * vz - uz * vy
        y += uz * vx - ux * vz
        z += ux * vy - uy * vx
    return x, y, z


@helper(forceinline=True, **LOOPS)
def _unit(x, y, z):
    one, tiny = np.float32(1), np.float32(1e-20)
    scale = one / max(np.sqrt(x * x + y * y + z * z), tiny)
    return x * scale, y * scale, z * scale


@helper(forceinline=True, **LOOPS)
def _local_frame(points, nx, ny, nz, v, w, t):
    """Tangent, towards the neighbour ``w``, bitangent and normal of vertex ``v`` in frame ``t``: nine numbers."""
    nx, ny, nz = _unit(nx, ny, nz)
    tx, ty, tz = _minus(points, w, v, t)
    along = tx * nx + ty * ny + tz * nz
    tx, ty, tz = _unit(tx - along * nx, ty - along * ny, tz - along * nz)
    return tx, ty, tz, ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx, nx, ny, nz


def take_details(
    points: Block,
    starts: Ids,
    edges: Ids,
    neighbour: Ids,
    smooth: Block,
    delta: Block,
    rest_offset: Block,
    rest_detail: Block,
    out: Block,
) -> None:
    """Turn deltas into motion details, ``d = F^T (delta - smooth + rest_offset) - e_0`` (method 3, Eq. 3).

    ``points`` (V, 3, B) are smoothed, ``smooth`` and ``delta`` (V, 3, B) the smoothed and the full change since rest,
    ``rest_offset`` and ``rest_detail`` (V, 3) the rest shape's detail, plain and in its local frames; ``starts`` and
    ``edges`` are the mesh's `opposite_edges`.
    """
    normal = scratch("normal", points.shape[1:], points.dtype)
    _take_details(points, starts, edges, neighbour, smooth, delta, rest_offset, rest_detail, normal, out)


@njit(**ARITHMETIC)
def _take_details(points, starts, edges, neighbour, smooth, delta, rest_offset, rest_detail, normal, out):
    for v in range(len(points)):
        _sum_normals(points, starts, edges, v, normal)
        w = neighbour[v]
        ox, oy, oz = rest_offset[v, 0], rest_offset[v, 1], rest_offset[v, 2]
        ex, ey, ez = rest_detail[v, 0], rest_detail[v, 1], rest_detail[v, 2]
        for t in range(points.shape[2]):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _local_frame(points, normal[0, t], normal[1, t], normal[2, t], v, w, t)
            x = delta[v, 0, t] - smooth[v, 0, t] + ox
            y = delta[v, 1, t] - smooth[v, 1, t] + oy
            z = delta[v, 2, t] - smooth[v, 2, t] + oz
            out[v, 0, t] = tx * x + ty * y + tz * z - ex
            out[v, 1, t] = bx * x + by * y + bz * z - ey
            out[v, 2, t] = nx * x + ny * y + nz * z - ez


def rotate_details(
    points: Block,
    starts: Ids,
    edges: Ids,
    neighbour: Ids,
    details: Block,
    gain: NDArray[np.floating],
    rest_detail: Block,
    out: Block,
) -> None:
    """Turn local details into displacements of the frame: ``out = F (e_0 + gain d)`` (method 7, Eqs. 5 and 16).

    ``points``, ``details`` and ``out`` (V, 3, B); ``gain`` (V,), ``rest_detail`` (V, 3); ``starts`` and ``edges`` are
    the mesh's `opposite_edges`.
    """
    normal = scratch("normal", points.shape[1:], points.dtype)
    _rotate_details(points, starts, edges, neighbour, details, gain, rest_detail, normal, out)


@njit(**ARITHMETIC)
def _rotate_details(points, starts, edges, neighbour, details, gain, rest_detail, normal, out):
    for v in range(len(points)):
        _sum_normals(points, starts, edges, v, normal)
        w, g = neighbour[v], gain[v]
        ex, ey, ez = rest_detail[v, 0], rest_detail[v, 1], rest_detail[v, 2]
        for t in range(points.shape[2]):
            tx, ty, tz, bx, by, bz, nx, ny, nz = _local_frame(points, normal[0, t], normal[1, t], normal[2, t], v, w, t)
            x, y, z = g * details[v, 0, t] + ex, g * details[v, 1, t] + ey, g * details[v, 2, t] + ez
            out[v, 0, t] = tx * x + bx * y + nx * z
            out[v, 1, t] = ty * x + by * y + ny * z
            out[v, 2, t] = tz * x + bz * y + nz * z


def block_frames(points: Block, starts: Ids, edges: Ids, neighbour: Ids) -> Block:
    """Local frames ``(V, 3, 3, B)`` of a block, columns (tangent, bitangent, normal)."""
    frames = np.empty((len(points), 3, *points.shape[1:]), points.dtype)
    _make_frames(points, starts, edges, neighbour, frames)
    return frames


@njit(**LOOPS)
def _make_frames(points, starts, edges, neighbour, frames):
    for v in range(len(points)):
        for t in range(points.shape[2]):
            normal = _sum_normal(points, starts, edges, v, t)
            columns = _local_frame(points, normal[0], normal[1], normal[2], v, neighbour[v], t)
            for k in range(3):
                for i in range(3):
                    frames[v, i, k, t] = columns[3 * k + i]
