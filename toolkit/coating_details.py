"""The paper's own reconstruction of details: rotated Laplacian coatings and a Poisson solve, screened (Eqs. 5 and 16).

Rotated coatings are not integrable; without screening the solve turns the mismatch into drift of the whole face. Kept
so that users can compare it with the displacement form on their own faces.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.decomposition import Decomposer
from toolkit.frame_kernels import block_frames
from toolkit.mesh.topology import vertex_adjacency
from toolkit.solve import factorise

__all__ = ["CoatingDetails"]

Array = NDArray[np.float64]


class CoatingDetails:
    """Screened Poisson reconstruction: ``(D - A + eps D) d = D (xi' + eps p)`` for the displacement d of each frame.

    ``xi' = L (G_t e_0') + G_t g s (F_t^T xi_t - F_0^T xi_0)`` is the rotated coating, ``p`` the rotated displacement,
    ``D`` the degrees and ``A`` the adjacency. Solved in float64, one factor for all frames.

    Parameters
    ----------
    source, target : the decomposed references on the same topology and neighbours
    smooth_deltas, details : (T, V, 3) of the source, from the decomposition
    gain : (V,) factor of the motion details
    screening : eps, in units of the Laplacian's eigenvalues (0 to 2)
    """

    def __init__(
        self,
        source: Decomposer,
        target: Decomposer,
        smooth_deltas: NDArray[np.float32],
        details: NDArray[np.float32],
        gain: NDArray[np.floating],
        screening: float,
    ) -> None:
        order = target.filter.order
        n = len(order)
        adjacency = sp.csr_matrix(vertex_adjacency(target.mesh.triangles, n)[order][:, order])
        degree = np.maximum(np.asarray(adjacency.sum(axis=1)).ravel(), 1)
        self._laplacian = sp.csr_matrix(sp.identity(n) - sp.diags(1 / degree) @ adjacency)
        self._factor = factorise(sp.csc_matrix(sp.diags((1 + screening) * degree) - adjacency))
        self._weights, self._screening = degree, screening
        self._source, self._target, self._order = source, target, order
        self._smooth_deltas, self._details, self._gain = smooth_deltas, details, np.asarray(gain)[order]
        self._source_rest = self._local_coating(
            source, source.rest.smooth[order][:, :, None], source.rest.detail[order][:, :, None]
        )

    def displacement(self, points: NDArray, rotated: NDArray, start: int, stop: int) -> NDArray[np.float32]:
        """Displacement ``(V, 3, B)`` of the target's large-scale ``points``; ``rotated`` is the displacement form's."""
        source = self._source
        smooth = self._blocked(self._smooth_deltas[start:stop]) + source.rest.smooth[self._order][:, :, None]
        detail = self._blocked(self._details[start:stop]) + source.rest.detail[self._order][:, :, None]
        change = self._local_coating(source, smooth, detail) - self._source_rest
        frames = block_frames(points.astype(np.float64), *self._target.block.stencil)
        own = self._target.rest.detail[self._order]
        coating = self._apply(self._laplacian, np.einsum("vijb,vj->vib", frames, own))
        coating += np.einsum("vijb,vjb->vib", frames, self._gain[:, None, None] * change)
        right = self._weights[:, None, None] * (coating + self._screening * rotated)
        solved = self._factor.solve(right.reshape(len(right), -1))
        return solved.reshape(right.shape).astype(np.float32)

    def _blocked(self, frames: NDArray[np.float32]) -> Array:
        return np.moveaxis(frames[:, self._order].astype(np.float64), 0, 2)

    def _local_coating(self, decomposer: Decomposer, points: Array, detail: Array) -> Array:
        """``F^T L (F detail)``, ``(V, 3, B)``."""
        frames = block_frames(np.ascontiguousarray(points), *decomposer.block.stencil)
        coating = self._apply(self._laplacian, np.einsum("vijb,vjb->vib", frames, detail))
        return np.einsum("vjib,vjb->vib", frames, coating)

    @staticmethod
    def _apply(matrix: sp.csr_matrix, block: Array) -> Array:
        return np.asarray(matrix @ block.reshape(len(block), -1)).reshape(block.shape)
