"""A decimated copy of a mesh on which the heavy solves run, and the way back up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.mesh import TriangleMesh
from toolkit.mesh.closest import closest_weights
from toolkit.operators import uniform_laplacian
from toolkit.solve import factorise

__all__ = ["Coarse", "Gather", "decimate"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coarse:
    """``mesh`` of C vertices, and ``prolong`` (V, C) sparse, rows summing to one: fine ~ prolong @ coarse."""

    mesh: TriangleMesh
    prolong: sp.csr_matrix


def decimate(mesh: TriangleMesh, n_vertices: int) -> Coarse:
    """Quadric decimation to about ``n_vertices``, with the barycentric place of every fine vertex on the result.

    A fine vertex is looked for only on the coarse triangles round the vertex into which it collapsed, so the lips'
    two sheets never mix, however near they are. A mesh that is small enough is returned as it is.
    """
    if mesh.n_vertices <= n_vertices:
        return Coarse(mesh, sp.identity(mesh.n_vertices, format="csr"))
    import fast_simplification

    keep = min(0.999, n_vertices / mesh.n_vertices)
    _, _, collapses = fast_simplification.simplify(
        mesh.vertices, mesh.triangles, target_reduction=1.0 - keep, return_collapses=True
    )
    vertices, triangles, landed = fast_simplification.replay_simplification(mesh.vertices, mesh.triangles, collapses)
    coarse = TriangleMesh(np.asarray(vertices, dtype=np.float64), np.asarray(triangles, dtype=np.int32))
    return Coarse(coarse, _barycentric_rows(mesh.vertices, coarse, np.asarray(landed, dtype=np.int64)))


class Gather:
    """From fine to coarse: least-squares positions and averages, the counterpart of ``Coarse.prolong``."""

    def __init__(self, coarse: Coarse) -> None:
        self._prolong = coarse.prolong
        n = coarse.mesh.n_vertices
        laplacian = uniform_laplacian(coarse.mesh.triangles, n)
        normal = coarse.prolong.T @ coarse.prolong + 1e-4 * (laplacian.T @ laplacian) + 1e-9 * sp.identity(n)
        self._factor = factorise(sp.csc_matrix(normal))
        self._weight = np.maximum(np.asarray(coarse.prolong.sum(axis=0)).ravel(), 1e-12)

    def fit(self, fine: Array) -> Array:
        """Coarse positions ``(C, 3)`` whose prolongation is nearest to ``fine`` (V, 3)."""
        return self._factor.solve(self._prolong.T @ fine)

    def share(self, mask: NDArray) -> Array:
        """Weighted mean ``(C,)`` of a fine quantity round each coarse vertex."""
        return np.asarray(self._prolong.T @ mask.astype(float)) / self._weight

    def vote(self, labels: NDArray[np.int8]) -> NDArray[np.int8]:
        """Label ``(C,)`` of most of the fine vertices round each coarse one, 0 where they are divided."""
        return np.round(self.share(labels)).astype(np.int8)


def _barycentric_rows(points: Array, coarse: TriangleMesh, landed: NDArray[np.int64]) -> sp.csr_matrix:
    """For each fine point the nearest point among the triangles round the vertex ``landed`` (V,)."""
    n, corners = coarse.n_vertices, coarse.triangles
    n_triangles = coarse.n_triangles
    incidence = sp.csr_matrix(
        (np.ones(3 * n_triangles, dtype=np.int8), (corners.ravel(), np.repeat(np.arange(n_triangles), 3))),
        shape=(n, n_triangles),
    )
    near = incidence.tocsr()
    best = np.full(len(points), np.inf)
    triangle, weights = np.zeros(len(points), dtype=np.int64), np.tile([1.0, 0.0, 0.0], (len(points), 1))
    counts = np.diff(near.indptr)[landed]
    for k in range(int(counts.max(initial=0))):
        rows = np.flatnonzero(counts > k)
        candidate = near.indices[near.indptr[landed[rows]] + k]
        places = coarse.vertices[corners[candidate]]
        bary = closest_weights(points[rows], places)
        squared = np.sum((points[rows] - np.einsum("nk,nkd->nd", bary, places)) ** 2, axis=1)
        better = squared < best[rows]
        chosen = rows[better]
        best[chosen], triangle[chosen], weights[chosen] = squared[better], candidate[better], bary[better]
    columns = np.where(np.isfinite(best)[:, None], corners[triangle], landed[:, None])
    rows = np.repeat(np.arange(len(points)), 3)
    return sp.csr_matrix((weights.ravel(), (rows, columns.ravel())), shape=(len(points), n))
