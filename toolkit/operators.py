"""Linear operators that depend on the connectivity alone."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.mesh.topology import edge_counts, unique_edges, vertex_adjacency

__all__ = ["smoothing_average", "uniform_laplacian"]


def uniform_laplacian(triangles: NDArray[np.integer], n_vertices: int) -> sp.csr_matrix:
    """``(L x)_i = x_i - mean of its neighbours``, ``(V, V)`` (Sorkine et al. 2004; the paper's section 3).

    One null vector (the constant) for each connected component; 0 for a vertex without neighbours.
    """
    return sp.identity(n_vertices, format="csr") - _row_mean(vertex_adjacency(triangles, n_vertices))


def smoothing_average(triangles: NDArray[np.integer], n_vertices: int) -> sp.csr_matrix:
    """The average that Taubin's filter of MeshLab uses, ``(V, V)``.

    Each vertex's neighbours; a border vertex averages itself and its neighbours along the border, so that the border is
    smoothed as a curve and does not creep inwards. A vertex without neighbours keeps its own value.
    """
    edges, on_edge = unique_edges(triangles), edge_counts(triangles) == 1
    on_border = np.zeros(n_vertices, dtype=bool)
    on_border[edges[on_edge].ravel()] = True
    start, end = np.concatenate([edges, edges[:, ::-1]]).T
    seen = np.tile(on_edge, 2) | ~on_border[start]
    own = np.flatnonzero(on_border)
    rows, cols = np.concatenate([start[seen], own]), np.concatenate([end[seen], own])
    return _row_mean(sp.csr_matrix((np.ones(len(rows)), (rows, cols)), shape=(n_vertices, n_vertices)))


def _row_mean(adjacency: sp.csr_matrix) -> sp.csr_matrix:
    """The matrix whose rows are means over those of ``adjacency``; of an empty row, the identity's."""
    degree = np.diff(adjacency.indptr)
    mean = sp.csr_matrix((1 / np.repeat(degree, degree), adjacency.indices, adjacency.indptr), shape=adjacency.shape)
    return mean if degree.all() else sp.csr_matrix(mean + sp.diags((degree == 0).astype(float)))
