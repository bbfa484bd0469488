"""What follows from the triangles alone: edges, borders, neighbours, components."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components as _components

from toolkit.remembered import remembered

__all__ = [
    "boundary_edges",
    "boundary_vertices",
    "connected_components",
    "directed_edges",
    "edge_components",
    "edge_counts",
    "edge_matrix",
    "unique_edges",
    "vertex_adjacency",
]


def directed_edges(triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the three directed edges of every triangle, ``(3F, 2)``: all (0,1), then all (1,2), then all (2,0)."""
    t = np.asarray(triangles, dtype=np.int64)
    return np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])


def unique_edges(triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return each undirected edge once, ``(E, 2)`` with the lower id first, sorted."""
    return _edges_with_counts(triangles)[0]


def edge_counts(triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """Number of triangles on each of `unique_edges`, ``(E,)``."""
    return _edges_with_counts(triangles)[1]


def boundary_edges(triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the undirected edges that belong to exactly one triangle, ``(B, 2)``."""
    edges, counts = _edges_with_counts(triangles)
    return edges[counts == 1]


def boundary_vertices(triangles: NDArray[np.integer], n_vertices: int) -> NDArray[np.bool_]:
    """Mask ``(V,)`` of the vertices on an open border."""
    mask = np.zeros(n_vertices, dtype=bool)
    mask[boundary_edges(triangles).ravel()] = True
    return mask


def vertex_adjacency(triangles: NDArray[np.integer], n_vertices: int) -> sp.csr_matrix:
    """Symmetric 0/1 matrix ``(V, V)``: entry (i, j) is 1 where an edge joins vertices i and j."""
    edges = unique_edges(triangles)
    i, j = edges[:, 0], edges[:, 1]
    ones = np.ones(2 * len(edges))
    rows, cols = np.concatenate([i, j]), np.concatenate([j, i])
    return sp.csr_matrix((ones, (rows, cols)), shape=(n_vertices, n_vertices))


def connected_components(triangles: NDArray[np.integer], n_vertices: int) -> tuple[int, NDArray[np.int32]]:
    """Return the number of components and the label ``(V,)`` of each vertex; a lone vertex is its own component."""
    return edge_components(unique_edges(triangles), n_vertices)


def edge_components(edges: NDArray[np.integer], n_vertices: int) -> tuple[int, NDArray[np.int32]]:
    """As `connected_components`, for edges ``(E, 2)`` that are sorted, each once, lower id first."""
    count, labels = _components(edge_matrix(edges, np.ones(len(edges), np.int8), n_vertices), directed=False)
    return int(count), labels


def edge_matrix(edges: NDArray[np.integer], values: NDArray, n_vertices: int) -> sp.csr_matrix:
    """Half a matrix ``(V, V)``: values ``(E,)`` of edges ``(E, 2)`` that are sorted, each once, lower id first."""
    # Such edges are rows as they are; some releases of SciPy take contiguous arrays only.
    starts, ends = np.searchsorted(edges[:, 0], np.arange(n_vertices + 1)), np.ascontiguousarray(edges[:, 1])
    return sp.csr_matrix((values, ends, starts), shape=(n_vertices, n_vertices))


@remembered
def _edges_with_counts(triangles: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Kept, since every operator on a mesh asks for them, and so read-only."""
    t = np.asarray(triangles, dtype=np.int64)
    n = max(1, int(t.max(initial=-1)) + 1)
    sides = [np.minimum(a, b) * n + np.maximum(a, b) for a, b in ((t[:, i], t[:, (i + 1) % 3]) for i in range(3))]
    keys, counts = np.unique(np.concatenate(sides), return_counts=True)
    edges = np.stack([keys // n, keys % n], axis=1)
    edges.setflags(write=False)
    counts.setflags(write=False)
    return edges, counts
