"""Regions of the face that an edit names by distance."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from toolkit.errors import InputError

__all__ = ["distance_from", "vertices_beyond"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


def vertices_beyond(vertices: Array, graph: sp.csr_matrix, start: NDArray[np.integer], distance: float) -> Ids:
    """Vertices farther than ``distance`` from the ``start`` vertices, sorted; see `distance_from`."""
    return np.flatnonzero(distance_from(vertices, graph, start) > distance)


def distance_from(vertices: Array, graph: sp.csr_matrix, start: NDArray[np.integer]) -> Array:
    """Distance of each vertex (V,) to the nearest of the ``start`` vertices, in mesh units.

    Along the edges of the mesh (`toolkit.mesh.edge_graph`), so that the upper lip is far from the lower one; parts that
    no edges join to the start, as eyes and teeth, as the crow flies.
    """
    start = np.unique(np.asarray(start, dtype=np.int64))
    if not len(start):
        raise InputError("nothing says from where the distance counts", remedy="give vertices, or points to move")
    along = dijkstra(graph, indices=start, min_only=True)
    apart = np.flatnonzero(np.isinf(along))
    if len(apart):
        along[apart] = cKDTree(vertices[start]).query(vertices[apart])[0]
    return np.asarray(along)
