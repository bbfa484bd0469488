"""Compiled measures of triangles and edges, in one pass each: a film face has millions of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.compiled import LOOPS, njit
from toolkit.gradient_kernels import triangle_edges

__all__ = ["flatness", "part_volumes", "squared_lengths"]

Array = NDArray[np.float64]
Ids = NDArray[np.integer]


def squared_lengths(points: Array, edges: Ids) -> Array:
    """Squared lengths (E,) of edges (E, 2) between points (V, 3)."""
    squared = np.empty(len(edges))
    _squared_lengths(points, edges, squared)
    return squared


@njit(**LOOPS)
def _squared_lengths(points: Array, edges: Ids, squared: Array) -> None:
    for e in range(len(edges)):
        i, j = edges[e, 0], edges[e, 1]
        x, y, z = points[i, 0] - points[j, 0], points[i, 1] - points[j, 1], points[i, 2] - points[j, 2]
        squared[e] = x * x + y * y + z * z


def flatness(vertices: Array, triangles: Ids) -> Array:
    """Least height (F,) of every triangle, in mesh units: twice its area over its longest side, 0 where that is 0."""
    heights = np.empty(len(triangles))
    _flatness(vertices, triangles, heights)
    return heights


@njit(**LOOPS)
def _flatness(vertices: Array, triangles: Ids, heights: Array) -> None:
    for f in range(len(triangles)):
        e, g, x, y, z = triangle_edges(vertices, triangles, f)
        longest = 0.0
        for u, v, w in (e, g, (g[0] - e[0], g[1] - e[1], g[2] - e[2])):
            squared = u * u + v * v + w * w
            longest = squared if squared > longest else longest
        heights[f] = np.sqrt((x * x + y * y + z * z) / longest) if longest > 0 else 0.0


def part_volumes(vertices: Array, triangles: Ids, parts: Ids, middles: Array) -> tuple[Array, Array]:
    """Sums of ``a . (b x c) / 6`` and of areas over the triangles of every part, (parts,) each.

    ``parts`` (V,) is the part of each vertex, ``middles`` (parts, 3) where the origin is for each, for the digits.
    """
    volumes, areas = np.zeros(len(middles)), np.zeros(len(middles))
    _part_volumes(vertices, triangles, parts, middles, volumes, areas)
    return volumes, areas


@njit(**LOOPS)
def _part_volumes(vertices: Array, triangles: Ids, parts: Ids, middles: Array, volumes: Array, areas: Array) -> None:
    for f in range(len(triangles)):
        first = triangles[f, 0]
        part = parts[first]
        _, _, x, y, z = triangle_edges(vertices, triangles, f)
        u, v, w = vertices[first, 0], vertices[first, 1], vertices[first, 2]
        # a . (b x c) = a . ((b - a) x (c - a))
        volumes[part] += ((u - middles[part, 0]) * x + (v - middles[part, 1]) * y + (w - middles[part, 2]) * z) / 6
        areas[part] += np.sqrt(x * x + y * y + z * z) / 2
