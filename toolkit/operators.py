"""Linear operators that depend on the connectivity alone."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.mesh.topology import boundary_edges, vertex_adjacency

__all__ = ["neighbour_average", "smoothing_average", "uniform_laplacian"]


def neighbour_average(triangles: NDArray[np.integer], n_vertices: int) -> sp.csr_matrix:
    """Mean of each vertex's neighbours, ``(V, V)``; a vertex without neighbours keeps its own value."""
    return _row_mean(vertex_adjacency(triangles, n_vertices))


def uniform_laplacian(triangles: NDArray[np.integer], n_vertices: int) -> sp.csr_matrix:
    """``(L x)_i = x_i - mean of its neighbours``, ``(V, V)`` (Sorkine et al. 2004; the paper's section 3).

    One null vector (the constant) for each connected component.
    """
    return (sp.identity(n_vertices, format="csr") - neighbour_average(triangles, n_vertices)).tocsr()


def smoothing_average(triangles: NDArray[np.integer], n_vertices: int) -> sp.csr_matrix:
    """The average that Taubin's filter of MeshLab uses, ``(V, V)``.

    As `neighbour_average`, but a border vertex averages itself and its neighbours along the border, so that the
    border is smoothed as a curve and does not creep inwards.
    """
    border = boundary_edges(triangles)
    on_border = np.zeros(n_vertices, dtype=bool)
    on_border[border.ravel()] = True
    inner = sp.diags((~on_border).astype(float)) @ vertex_adjacency(triangles, n_vertices)
    rows = np.concatenate([border[:, 0], border[:, 1], np.flatnonzero(on_border)])
    cols = np.concatenate([border[:, 1], border[:, 0], np.flatnonzero(on_border)])
    along = sp.csr_matrix((np.ones(len(rows)), (rows, cols)), shape=(n_vertices, n_vertices))
    return _row_mean(sp.csr_matrix(inner + along))


def _row_mean(adjacency: sp.csr_matrix) -> sp.csr_matrix:
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    lonely = sp.diags((degree == 0).astype(float))
    return sp.csr_matrix(sp.diags(1 / np.maximum(degree, 1)) @ adjacency + lonely)
