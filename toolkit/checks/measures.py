"""Compiled measures of triangles and edges, in one pass each: a film face has millions of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.compiled import LOOPS, njit

__all__ = ["flatness", "part_volumes", "squared_lengths"]

Array = NDArray[np.float64]
Ids = NDArray[np.integer]


@njit(**LOOPS)
def squared_lengths(points: Array, edges: Ids) -> Array:
    """Squared lengths (E,) of edges (E, 2) between points (V, 3)."""
    squared = np.empty(len(edges))
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
        squared[e] = x * x + y * y + z * z
    return squared


@njit(**LOOPS)
def flatness(vertices: Array, triangles: Ids) -> Array:
    """Least height (F,) of every triangle, in mesh units: twice its area over its longest side, 0 where that is 0."""
    heights = np.empty(len(triangles))
    side = np.empty((3, 3))
    for f in range(len(triangles)):
        longest = 0.0
        for k in range(3):
            squared = 0.0
            for i in range(3):
                side[k, i] = vertices[triangles[f, (k + 1) % 3], i] - vertices[triangles[f, k], i]
                squared += side[k, i] ** 2
            longest = max(longest, squared)
        area = 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            area += (side[0, j] * side[1, k] - side[0, k] * side[1, j]) ** 2
        heights[f] = np.sqrt(area / longest) if longest > 0 else 0.0
    return heights


@njit(**LOOPS)
def part_volumes(vertices: Array, triangles: Ids, parts: Ids, middles: Array) -> tuple[Array, Array]:
    """Sums of ``a . (b x c) / 6`` and of areas over the triangles of every part, (parts,) each.

    ``parts`` (V,) is the part of each vertex, ``middles`` (parts, 3) where the origin is for each, for the digits.
    """
    volumes, areas = np.zeros(len(middles)), np.zeros(len(middles))
    corner = np.empty((3, 3))
    for f in range(len(triangles)):
        part = parts[triangles[f, 0]]
        for k in range(3):
            for i in range(3):
                corner[k, i] = vertices[triangles[f, k], i] - middles[part, i]
        squared = 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            normal = (corner[1, j] - corner[0, j]) * (corner[2, k] - corner[0, k])
            normal -= (corner[1, k] - corner[0, k]) * (corner[2, j] - corner[0, j])
            squared += normal**2
            volumes[part] += corner[0, i] * normal / 6
        areas[part] += np.sqrt(squared) / 2
    return volumes, areas
