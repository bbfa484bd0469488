"""Edges with their faces: what manifoldness, winding and parts are read from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from toolkit.mesh.topology import directed_edges

__all__ = ["EdgeTable", "edge_table"]

Ids = NDArray[np.int64]


@dataclass(frozen=True)
class EdgeTable:
    """Undirected edges of F triangles over ``n_vertices`` vertices.

    ``edges`` (E, 2) lower id first, sorted; ``counts`` (E,) faces of each; ``balance`` (E,) how often it runs upwards
    less how often downwards: 0 where two faces agree; ``first`` (E,) where its faces start in ``faces`` (3F,).
    """

    n_vertices: int
    edges: Ids
    counts: Ids
    balance: Ids
    first: Ids
    faces: Ids

    def faces_of(self, edge: int) -> Ids:
        """Return the faces at one edge."""
        return self.faces[self.first[edge] : self.first[edge] + self.counts[edge]]

    @property
    def border(self) -> Ids:
        """Undirected edges ``(B, 2)`` of one face."""
        return self.edges[self.counts == 1]

    def neighbour_faces(self) -> tuple[Ids, Ids, NDArray[np.bool_]]:
        """Pairs of faces that share a two-sided edge, ``(N,)`` each, and whether they agree about the outside."""
        two = self.counts == 2
        start = self.first[two]
        return self.faces[start], self.faces[start + 1], self.balance[two] == 0

    def parts(self) -> NDArray[np.int32]:
        """Label ``(V,)`` of the connected part of each vertex; a lone vertex is a part of its own."""
        i, j = self.edges.T
        graph = sp.csr_matrix((np.ones(len(i), dtype=np.int8), (i, j)), shape=(self.n_vertices, self.n_vertices))
        return connected_components(graph, directed=False)[1]


def edge_table(triangles: NDArray[np.integer], n_vertices: int) -> EdgeTable:
    """Collect the edges of triangles ``(F, 3)`` whose corners are distinct and in range."""
    directed = directed_edges(triangles)
    low, high = np.minimum(*directed.T), np.maximum(*directed.T)
    keys = low * n_vertices + high
    order = np.argsort(keys, kind="stable")
    unique, first, counts = np.unique(keys[order], return_index=True, return_counts=True)
    upwards = np.where(directed[:, 0] < directed[:, 1], 1, -1)[order]
    balance = np.add.reduceat(upwards, first) if len(first) else np.zeros(0, dtype=np.int64)
    edges = np.stack([unique // max(n_vertices, 1), unique % max(n_vertices, 1)], axis=1)
    return EdgeTable(n_vertices, edges, counts, balance, first, order % max(len(triangles), 1))
