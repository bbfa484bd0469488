"""Deformation transfer as Sumner and Popovic wrote it (2004), frame by frame, with SciPy: what one would script.

A fourth vertex is put off every triangle, ``v_4 = v_1 + n / sqrt|n|``. With ``V = [v_2 - v_1, v_3 - v_1, v_4 - v_1]``
the source's deformation is ``S = V' V^-1``, and the target's vertices minimise ``sum_f |S_f - T_f|^2``, a linear least
squares problem whose matrix is the same in every frame: its normal equations are factorised once.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

__all__ = ["transfer_frames"]

Array = NDArray[np.float64]


def transfer_frames(
    source: Array, frames: NDArray[np.floating], target: Array, triangles: NDArray[np.integer], anchors: NDArray
) -> Iterator[Array]:
    """Target frames ``(V, 3)`` for source frames ``(T, V, 3)``; ``anchors`` move as on the source, one a component."""
    n = len(source)
    inverse = np.linalg.inv(_spans(source, triangles))
    matrix = _gradient(target, triangles)
    pins = sp.csr_matrix(
        (np.ones(len(anchors)), (np.arange(len(anchors)), anchors)), shape=(len(anchors), matrix.shape[1])
    )
    system = sp.vstack([matrix, pins]).tocsc()
    factor = splu((system.T @ system).tocsc())
    for frame in frames:
        deformation = _spans(frame.astype(np.float64), triangles) @ inverse
        held = target[anchors] + frame[anchors] - source[anchors]
        right = np.concatenate([deformation.transpose(0, 2, 1).reshape(-1, 3), held])
        yield factor.solve(system.T @ right)[:n]


def _spans(vertices: Array, triangles: NDArray[np.integer]) -> Array:
    """``V`` of every triangle, ``(F, 3, 3)``."""
    v1, v2, v3 = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(v2 - v1, v3 - v1)
    fourth = normal / np.sqrt(np.linalg.norm(normal, axis=1, keepdims=True))
    return np.stack([v2 - v1, v3 - v1, fourth], axis=2)


def _gradient(target: Array, triangles: NDArray[np.integer]) -> sp.csr_matrix:
    """Rows ``T_f^T = V^-T [x_2 - x_1, x_3 - x_1, x_4 - x_1]^T`` for all triangles, ``(3 F, n + F)``."""
    n, n_triangles = len(target), len(triangles)
    inverse = np.linalg.inv(_spans(target, triangles)).transpose(0, 2, 1)
    values = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
    corners = np.column_stack([triangles, n + np.arange(n_triangles)])
    rows = np.repeat(np.arange(3 * n_triangles), 4)
    columns = np.repeat(corners, 3, axis=0).ravel()
    return sp.csr_matrix((values.ravel(), (rows, columns)), shape=(3 * n_triangles, n + n_triangles))
