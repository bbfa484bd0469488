"""Rays from one point against a mesh, without a tree: one pass over its triangles, in a millisecond for 200,000.

What a tree costs to build (65 ms) would be due at every frame and every edit, for the few rays that a pointer asks for.
The rays have their origin in common, so that everything is flat as seen from there: a triangle whose flat bounding box
holds no ray is left out, the others are hit or missed as Moeller and Trumbore have it (1997), in double precision.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.compiled import njit

__all__ = ["first_hits", "triangles_of_vertices"]

Array = NDArray[np.float64]

_NEAR = 1e-9  # of a unit in front of the origin: nearer, and behind, nothing is flat
_SLACK = 1e-9  # of a triangle: rays through an edge must not slip between two


def first_hits(
    vertices: NDArray[np.float32], triangles: NDArray[np.int32], origin: Array, directions: Array, forward: Array
) -> tuple[NDArray[np.int64], Array, Array]:
    """The triangle that each ray meets first ``(n,)`` (-1 none), its weights ``(n, 3)``, and the distance ``(n,)``.

    ``directions`` (n, 3) are of unit length; those that do not look along ``forward`` (3,) meet nothing. Distances are
    in the mesh's unit, infinite where nothing is met.
    """
    axes = _axes(np.asarray(forward, dtype=np.float64))
    flat = np.empty((len(vertices), 3), np.float32)
    start = np.ascontiguousarray(origin, dtype=np.float64)
    _flatten(vertices, start, axes, flat)
    local = np.asarray(directions, dtype=np.float64) @ axes.T
    ahead = np.flatnonzero(local[:, 2] > _NEAR)
    places = local[ahead, :2] / local[ahead, 2:]
    order = np.argsort(places[:, 0], kind="stable")
    asked = ahead[order]
    ids, weights, reach = _cast(
        vertices, triangles, flat, start, np.ascontiguousarray(directions[asked], dtype=np.float64), places[order]
    )
    n = len(directions)
    all_ids, all_weights, all_reach = np.full(n, -1), np.zeros((n, 3)), np.full(n, np.inf)
    all_ids[asked], all_weights[asked], all_reach[asked] = ids, weights, reach
    return all_ids, all_weights, all_reach


@njit(cache=True, nogil=True, error_model="numpy")
def triangles_of_vertices(triangles: Any, n_vertices: int) -> Any:
    """Triangles round each vertex: those of vertex i are ``members[starts[i]:starts[i + 1]]``."""
    starts = np.zeros(n_vertices + 1, np.int64)
    for f in range(len(triangles)):
        for k in range(3):
            starts[triangles[f, k] + 1] += 1
    for i in range(n_vertices):
        starts[i + 1] += starts[i]
    free = starts[:-1].copy()
    members = np.empty(3 * len(triangles), np.int64)
    for f in range(len(triangles)):
        for k in range(3):
            vertex = triangles[f, k]
            members[free[vertex]] = f
            free[vertex] += 1
    return starts, members


def _axes(forward: Array) -> Array:
    """Right-handed unit axes ``(3, 3)``, the last along ``forward``."""
    ahead = forward / np.linalg.norm(forward)
    side = np.cross(np.eye(3)[int(np.argmin(np.abs(ahead)))], ahead)
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(ahead, side), ahead])


@njit(cache=True, nogil=True, error_model="numpy")
def _flatten(vertices: Any, origin: Any, axes: Any, out: Any) -> None:
    """Places of all vertices on the plane one unit ahead, and how far ahead they are."""
    for i in range(len(vertices)):
        x, y, z = vertices[i, 0] - origin[0], vertices[i, 1] - origin[1], vertices[i, 2] - origin[2]
        depth = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z
        scale = 1.0 / depth if depth > _NEAR else 0.0
        out[i, 0] = (axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z) * scale
        out[i, 1] = (axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z) * scale
        out[i, 2] = depth


@njit(cache=True, nogil=True, error_model="numpy")
def _cast(vertices: Any, triangles: Any, flat: Any, origin: Any, directions: Any, places: Any) -> Any:
    """Rays sorted by the first of their ``places`` (n, 2)."""
    n = len(directions)
    ids, weights, reach = np.full(n, -1, np.int64), np.zeros((n, 3)), np.full(n, np.inf)
    if n == 0:
        return ids, weights, reach
    bottom, top = places[:, 1].min(), places[:, 1].max()
    for f in range(len(triangles)):
        i, j, k = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        nearest = min(flat[i, 2], flat[j, 2], flat[k, 2])
        low_x, low_y, high_x, high_y = -np.inf, -np.inf, np.inf, np.inf
        if nearest > _NEAR:
            low_x, high_x = min(flat[i, 0], flat[j, 0], flat[k, 0]), max(flat[i, 0], flat[j, 0], flat[k, 0])
            low_y, high_y = min(flat[i, 1], flat[j, 1], flat[k, 1]), max(flat[i, 1], flat[j, 1], flat[k, 1])
            slack = 1e-6 * (1.0 + max(abs(low_x), abs(high_x), abs(low_y), abs(high_y)))  # single precision
            low_x, low_y, high_x, high_y = low_x - slack, low_y - slack, high_x + slack, high_y + slack
            if high_y < bottom or low_y > top or high_x < places[0, 0] or low_x > places[n - 1, 0]:
                continue
        elif max(flat[i, 2], flat[j, 2], flat[k, 2]) <= _NEAR:
            continue
        for ray in range(np.searchsorted(places[:, 0], low_x), n):
            if places[ray, 0] > high_x:
                break
            if low_y <= places[ray, 1] <= high_y:
                t, u, v = _met(vertices, i, j, k, origin, directions[ray])
                if t < reach[ray]:
                    ids[ray], reach[ray] = f, t
                    weights[ray, 0], weights[ray, 1], weights[ray, 2] = 1.0 - u - v, u, v
    return ids, weights, reach


@njit(cache=True, nogil=True, error_model="numpy")
def _met(vertices: Any, i: int, j: int, k: int, origin: Any, direction: Any) -> Any:
    """Distance to a triangle and the weights of its second and third corner; infinite where the ray misses it."""
    a0, a1, a2 = np.float64(vertices[i, 0]), np.float64(vertices[i, 1]), np.float64(vertices[i, 2])
    e0, e1, e2 = vertices[j, 0] - a0, vertices[j, 1] - a1, vertices[j, 2] - a2
    g0, g1, g2 = vertices[k, 0] - a0, vertices[k, 1] - a1, vertices[k, 2] - a2
    d0, d1, d2 = direction[0], direction[1], direction[2]
    p0, p1, p2 = d1 * g2 - d2 * g1, d2 * g0 - d0 * g2, d0 * g1 - d1 * g0
    volume = e0 * p0 + e1 * p1 + e2 * p2
    if volume == 0.0:
        return np.inf, 0.0, 0.0
    s0, s1, s2 = origin[0] - a0, origin[1] - a1, origin[2] - a2
    u = (s0 * p0 + s1 * p1 + s2 * p2) / volume
    q0, q1, q2 = s1 * e2 - s2 * e1, s2 * e0 - s0 * e2, s0 * e1 - s1 * e0
    v = (d0 * q0 + d1 * q1 + d2 * q2) / volume
    t = (g0 * q0 + g1 * q1 + g2 * q2) / volume
    if u < -_SLACK or v < -_SLACK or u + v > 1.0 + _SLACK or t <= 0.0:
        return np.inf, 0.0, 0.0
    return t, u, v
