"""Closest points on a surface, in double precision and without a scene to build."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.detail_edit.surface import Surface

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
        weights = _closest_weights(points[:, None], self._corners[near])
        places = np.einsum("nck,nckd->ncd", weights, self._corners[near])
        rows = np.arange(len(points))
        best = np.argmin(((places - points[:, None]) ** 2).sum(axis=2), axis=1)
        return places[rows, best], self._ids[near[rows, best]], weights[rows, best]


def _closest_weights(points: Array, corners: Array) -> Array:
    """Weights ``(..., 3)`` of the points of triangles ``(..., 3, 3)`` closest to ``points`` (..., 3).

    By scalar products alone: curves ask this of a few points at a time, hundreds of times.
    """
    first, second = corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    off = points - corners[..., 0, :]
    aa, ab, bb = (np.einsum("...d,...d->...", x, y) for x, y in ((first, first), (first, second), (second, second)))
    pa, pb = np.einsum("...d,...d->...", off, first), np.einsum("...d,...d->...", off, second)
    area = np.maximum(aa * bb - ab**2, 1e-300)
    u, v = (bb * pa - ab * pb) / area, (aa * pb - ab * pa) / area
    outside = (u < 0) | (v < 0) | (u + v > 1)
    along = np.clip((pb - pa - ab + aa) / np.maximum(aa - 2 * ab + bb, 1e-300), 0, 1)
    nothing = np.zeros_like(pa)
    sides = (
        (np.clip(pa / np.maximum(aa, 1e-300), 0, 1), nothing),
        (nothing, np.clip(pb / np.maximum(bb, 1e-300), 0, 1)),
        (1 - along, along),
    )
    nearest = np.full(pa.shape, np.inf)
    for a, b in sides:
        away = a * a * aa + 2 * a * b * ab + b * b * bb - 2 * (a * pa + b * pb)  # less |off|^2, the same for all
        better = outside & (away < nearest)
        u, v = np.where(better, a, u), np.where(better, b, v)
        nearest = np.where(better, away, nearest)
    return np.stack([1 - u - v, u, v], axis=-1)
