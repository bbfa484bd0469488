"""Closest points on a surface, in double precision and without a scene to build."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.detail_edit.surface import Surface
from toolkit.mesh.closest import closest_weights

__all__ = ["Ground"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

_NEAR = 16
_BATCH = 20_000


class Ground:
    """Closest points on a surface, or on some of its ``triangles`` (f,) ids.

    Looked for in the triangles whose middles are nearest: good for points near the surface, as those of curves and of
    mirrored shapes are.
    """

    def __init__(self, surface: Surface, triangles: Ids | None = None) -> None:
        self._ids = np.arange(len(surface.triangles)) if triangles is None else triangles
        self._corners = surface.vertices[surface.triangles[self._ids]]
        self._tree = cKDTree(self._corners.mean(axis=1))

    def closest(self, points: Array) -> tuple[Array, Ids, Array]:
        """Closest points ``(n, 3)``, their triangles ``(n,)`` and weights ``(n, 3)``."""
        parts = [self._closest(points[k : k + _BATCH]) for k in range(0, max(len(points), 1), _BATCH)]
        places, triangles, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
        return places, triangles, weights

    def _closest(self, points: Array) -> tuple[Array, Ids, Array]:
        count = min(_NEAR, len(self._ids))
        near = np.asarray(self._tree.query(points, k=count)[1]).reshape(len(points), count)
        weights = closest_weights(points[:, None], self._corners[near])
        places = np.einsum("nck,nckd->ncd", weights, self._corners[near])
        rows = np.arange(len(points))
        best = np.argmin(((places - points[:, None]) ** 2).sum(axis=2), axis=1)
        return places[rows, best], self._ids[near[rows, best]], weights[rows, best]
