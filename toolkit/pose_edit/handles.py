"""Where the user's pull takes hold: a small disc round each constrained vertex."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

__all__ = ["Handles"]

Array = NDArray[np.float64]


class Handles:
    """Pulls on discs of a ``radius`` in mesh units, measured along the edges of the mesh (`toolkit.mesh.edge_graph`).

    Along the edges, so that a pull on the upper lip does not take hold of the lower one.
    """

    def __init__(self, graph: sp.csr_matrix, radius: float) -> None:
        self.radius = radius
        self._graph = graph
        self._known: dict[int, tuple[NDArray[np.int64], Array]] = {}

    def pulls(self, vertices: NDArray[np.int64]) -> sp.csc_matrix:
        """``F`` (V, U): each column a pull of sum 1, strongest at its vertex and fading to the disc's rim."""
        parts = [self._pull(int(v)) for v in vertices]
        starts = np.cumsum([0] + [len(ids) for ids, _ in parts])
        ids = np.concatenate([ids for ids, _ in parts]) if parts else np.zeros(0, dtype=np.int64)
        values = np.concatenate([pull for _, pull in parts]) if parts else np.zeros(0)
        return sp.csc_matrix((values, ids, starts), shape=(self._graph.shape[0], len(vertices)))

    def _pull(self, vertex: int) -> tuple[NDArray[np.int64], Array]:
        if self.radius <= 0:
            return np.array([vertex]), np.ones(1)
        if vertex not in self._known:
            distance = dijkstra(self._graph, indices=vertex, limit=self.radius)
            ids = np.flatnonzero(distance < self.radius)
            strength = (1 - (distance[ids] / self.radius) ** 2) ** 2
            self._known[vertex] = (ids, strength / strength.sum())
        return self._known[vertex]
