"""Catmull-Clark subdivision of a quad mesh as one sparse matrix, with the paths that it refines."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["Subdivision", "catmull_clark"]

Index = NDArray[np.int64]


@dataclass(frozen=True)
class Subdivision:
    """``levels`` rounds of Catmull-Clark.

    ``matrix`` (n_fine, n_base) maps positions and offsets alike. ``quads[k]`` (F_k, 4) are the faces after k rounds.
    The vertices of round k come first in round k + 1 with the same ids, so ``matrix[:counts[k]]`` gives the vertices
    of round k where they lie on the *finest* surface, and ids of coarse vertices stay valid.
    """

    matrix: sp.csr_matrix
    quads: tuple[Index, ...]
    counts: tuple[int, ...]
    midpoints: tuple[dict[tuple[int, int], int], ...]

    def refine_path(self, path: list[int], level: int) -> list[int]:
        """Return the same edge path after ``level`` rounds: the new vertex of every edge is put between its ends."""
        for lookup in self.midpoints[:level]:
            fine = [path[0]]
            for a, b in pairwise(path):
                fine += [lookup[min(a, b), max(a, b)], b]
            path = fine
        return path


def catmull_clark(quads: NDArray[np.integer], n_vertices: int, levels: int) -> Subdivision:
    """Build the operator of ``levels`` rounds; borders become cubic B-splines (Catmull and Clark 1978)."""
    faces = [np.asarray(quads, dtype=np.int64)]
    counts, midpoints = [n_vertices], []
    matrix = sp.identity(n_vertices, format="csr")
    for _ in range(levels):
        step, fine, edges = _one_round(faces[-1], counts[-1])
        ids = range(counts[-1], counts[-1] + len(edges))
        midpoints.append({(int(a), int(b)): i for (a, b), i in zip(edges, ids, strict=True)})
        matrix = (step @ matrix).tocsr()
        faces.append(fine)
        counts.append(step.shape[0])
    matrix.sort_indices()
    return Subdivision(matrix, tuple(faces), tuple(counts), tuple(midpoints))


def _one_round(quads: Index, n: int) -> tuple[sp.csr_matrix, Index, Index]:
    ends = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=2), axis=2)
    # One number for each edge: rows of numbers take much longer to sort.
    keys, side_edge, uses = np.unique(ends[..., 0] * n + ends[..., 1], return_inverse=True, return_counts=True)
    edges, side_edge = np.stack(np.divmod(keys, n), axis=1), side_edge.reshape(-1, 4)
    n_faces, n_edges = len(quads), len(edges)

    face_point = _rows(np.repeat(np.arange(n_faces), 4), quads.ravel(), 0.25, (n_faces, n))
    middle = _rows(np.repeat(np.arange(n_edges), 2), edges.ravel(), 0.5, (n_edges, n))
    on_face = _rows(side_edge.ravel(), np.repeat(np.arange(n_faces), 4), 1.0, (n_edges, n_faces))
    inner = uses == 2
    edge_point = (
        sp.diags(np.where(inner, 0.5, 1.0)) @ middle + sp.diags(np.where(inner, 0.25, 0)) @ on_face @ face_point
    )

    vertex_point = _vertex_points(quads, edges, inner, face_point, middle, n)
    step = sp.vstack([vertex_point, edge_point, face_point]).tocsr()
    edge_id, face_id = n + side_edge, n + n_edges + np.arange(n_faces)
    corners = [np.stack([quads[:, k], edge_id[:, k], face_id, edge_id[:, k - 1]], axis=1) for k in range(4)]
    return step, np.stack(corners, axis=1).reshape(-1, 4), edges


def _vertex_points(
    quads: Index, edges: Index, inner: NDArray[np.bool_], face_point: sp.csr_matrix, middle: sp.csr_matrix, n: int
) -> sp.csr_matrix:
    """Interior ``(F + 2 R + (k - 3) P) / k`` with valence k; on the border ``(6 P + its two neighbours) / 8``."""
    n_faces, n_edges = len(quads), len(edges)
    faces_at = _rows(quads.ravel(), np.repeat(np.arange(n_faces), 4), 1.0, (n, n_faces))
    edges_at = _rows(edges.ravel(), np.repeat(np.arange(n_edges), 2), 1.0, (n, n_edges))
    valence = np.asarray(edges_at.sum(1)).ravel()
    border_edges_at = edges_at @ sp.diags((~inner).astype(np.float64))
    border = np.asarray(border_edges_at.sum(1)).ravel() > 0
    free = np.where(border, 0.0, 1.0)
    interior = (
        sp.diags(free / valence**2) @ faces_at @ face_point
        + sp.diags(2 * free / valence**2) @ edges_at @ middle
        + sp.diags(free * (valence - 3) / valence)
    )
    on_border = sp.diags(np.where(border, 0.25, 0.0)) @ border_edges_at @ middle + sp.diags(np.where(border, 0.5, 0.0))
    return (interior + on_border).tocsr()


def _rows(row: Index, col: Index, value: float, shape: tuple[int, int]) -> sp.csr_matrix:
    return sp.csr_matrix((np.full(len(row), value), (row, col)), shape=shape)
