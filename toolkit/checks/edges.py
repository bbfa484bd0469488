"""Edges with their faces: what manifoldness, winding and parts are read from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.mesh.topology import edge_components
from toolkit.remembered import remembered

__all__ = ["EdgeTable", "edge_table"]

Ids = NDArray[np.int32]


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

    @cached_property
    def parts(self) -> Ids:
        """Label ``(V,)`` of the connected part of each vertex; a lone vertex is a part of its own."""
        return edge_components(self.edges, self.n_vertices)[1]


@remembered
def edge_table(triangles: NDArray[np.integer], n_vertices: int) -> EdgeTable:
    """Collect the edges of triangles ``(F, 3)`` whose corners are distinct and in range.

    Every check and repair of a mesh asks for it, and a target may have the source's triangles: it is kept.
    """
    corners = np.ascontiguousarray(np.asarray(triangles, dtype=np.int32).T)
    start, end = corners.ravel(), corners[[1, 2, 0]].ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = _sorting(high, n_vertices)
    order = order[_sorting(low[order], n_vertices)]
    low, high = low[order], high[order]
    fresh = np.ones(len(order), dtype=bool)
    fresh[1:] = (low[1:] != low[:-1]) | (high[1:] != high[:-1])
    first = np.flatnonzero(fresh).astype(np.int32)
    upwards = np.where(start < end, 1, -1).astype(np.int32)[order]
    balance = np.add.reduceat(upwards, first) if len(first) else upwards
    edges = np.stack([low[first], high[first]], axis=1)
    counts = np.diff(first, append=np.int32(len(order)))
    return EdgeTable(n_vertices, edges, counts, balance, first, order % max(len(triangles), 1))


def _sorting(keys: Ids, n_keys: int) -> Ids:
    """Stable order of keys ``0 <= k < n_keys``: a transposed matrix has its entries sorted, in linear time."""
    n = len(keys)
    matrix = sp.csr_matrix((np.ones(n, dtype=np.int8), keys, np.arange(n + 1)), shape=(n, n_keys))
    order: Ids = matrix.tocsc().indices
    return order
