"""Linear operators that depend on the connectivity, or on the rest shape, alone."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.mesh.geometry import face_normals
from toolkit.mesh.topology import boundary_edges, vertex_adjacency

__all__ = ["gradient", "neighbour_average", "smoothing_average", "uniform_laplacian"]


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


def gradient(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> sp.csr_matrix:
    """Gradient of a piecewise linear function on the surface, ``(3F, V)``.

    Rows 3f..3f+2 give the gradient in triangle f, a vector in its plane: ``sum_j x_j grad phi_j`` with
    ``grad phi_j = n x e_j / (2 area)``, ``e_j`` the edge opposite to corner j.
    """
    corners = vertices[triangles]
    scaled_normal = face_normals(vertices, triangles, unit=False)
    squared = np.sum(scaled_normal**2, axis=1, keepdims=True)
    # A collapsed triangle has no gradient; it must not divide by zero, nor blow up its neighbours.
    floor = 1e-12 * np.median(squared) if len(squared) else 1.0
    inverse = np.where(squared > floor, 1 / np.maximum(squared, floor), 0.0)
    opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    values = np.cross(scaled_normal[:, None, :], opposite) * inverse[:, None, :]  # (F, corner, xyz)
    n_triangles = len(triangles)
    rows = 3 * np.arange(n_triangles)[:, None, None] + np.arange(3)[None, None, :]
    rows = np.broadcast_to(rows, values.shape)
    cols = np.broadcast_to(np.asarray(triangles)[:, :, None], values.shape)
    shape = (3 * n_triangles, len(vertices))
    return sp.csr_matrix((values.ravel(), (rows.ravel(), cols.ravel())), shape=shape)


def _row_mean(adjacency: sp.csr_matrix) -> sp.csr_matrix:
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    lonely = sp.diags((degree == 0).astype(float))
    return sp.csr_matrix(sp.diags(1 / np.maximum(degree, 1)) @ adjacency + lonely)
