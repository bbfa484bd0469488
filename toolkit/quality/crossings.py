"""Triangles that cross: lips through lips, lids through lids."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.feature_lines import Opening

__all__ = ["crossing_triangles", "rim_neighbourhood"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


def rim_neighbourhood(opening: Opening, triangles: NDArray[np.integer], rings: int = 3) -> Ids:
    """Ids of the triangles within so many rings of either rim, sorted."""
    near = np.zeros(int(triangles.max()) + 1, dtype=bool)
    near[opening.upper], near[opening.lower] = True, True
    for _ in range(rings - 1):
        near[triangles[near[triangles].any(axis=1)].ravel()] = True
    return np.flatnonzero(near[triangles].any(axis=1))


def crossing_triangles(
    vertices: NDArray[np.floating], triangles: NDArray[np.integer], among: NDArray[np.integer] | None = None
) -> Ids:
    """Ids of the triangles that cross another one of the mesh ``(V, 3)``, ``(F, 3)``, sorted.

    ``among`` limits the test to these triangles (all by default). Neighbours that share a vertex are not compared;
    nor is touching in a plane a crossing: an edge of one must pass through the inside of the other.
    """
    ids = np.arange(len(triangles)) if among is None else np.asarray(among)
    corners = np.asarray(vertices, dtype=np.float64)[np.asarray(triangles)[ids]]
    first, second = _near_pairs(corners, np.asarray(triangles)[ids])
    crosses = _edges_cross(corners[first], corners[second]) | _edges_cross(corners[second], corners[first])
    return np.unique(ids[np.concatenate([first[crosses], second[crosses]])])


def _near_pairs(corners: Array, triangles: NDArray[np.integer]) -> tuple[Ids, Ids]:
    """Pairs whose boxes overlap and that share no vertex."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    centre = (low + high) / 2
    radius = np.sqrt(np.sum((high - low) ** 2, axis=1)) / 2
    pairs = cKDTree(centre).query_pairs(2 * float(radius.max(initial=0)), output_type="ndarray")
    first, second = pairs.T
    overlap = np.all((low[first] <= high[second]) & (low[second] <= high[first]), axis=1)
    first, second = first[overlap], second[overlap]
    apart = ~(triangles[first][:, :, None] == triangles[second][:, None, :]).any(axis=(1, 2))
    return first[apart], second[apart]


def _edges_cross(first: Array, second: Array) -> NDArray[np.bool_]:
    """Whether an edge of ``first[i]`` passes through the inside of ``second[i]``; both ``(N, 3, 3)``."""
    a, b, c = second[:, 0], second[:, 1], second[:, 2]
    found = np.zeros(len(first), dtype=bool)
    for k in range(3):
        p, q = first[:, k], first[:, (k + 1) % 3]
        # Signed volumes: the ends lie on both sides of the plane, and the edge passes all three sides alike.
        u, v, w = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
        sides = _volume(a, b, c, p) * _volume(a, b, c, q)
        found |= (sides < 0) & (((u > 0) & (v > 0) & (w > 0)) | ((u < 0) & (v < 0) & (w < 0)))
    return found


def _volume(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Six times the signed volume of the tetrahedra a, b, c, d."""
    return np.einsum("ni,ni->n", np.cross(b - a, c - a), d - a)
