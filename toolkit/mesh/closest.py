"""Closest points of polylines and triangles, all against all or one against one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["closest_on_polyline", "closest_weights"]

Array = NDArray[np.float64]


def closest_on_polyline(points: Array, polyline: Array) -> Array:
    """Closest points ``(N, 3)`` on a polyline ``(m, 3)`` to ``points`` (N, 3)."""
    start, along = polyline[:-1], np.diff(polyline, axis=0)
    length = np.maximum(np.sum(along**2, axis=1), 1e-300)
    at = np.clip(np.einsum("nmd,md->nm", points[:, None] - start[None], along) / length, 0, 1)
    candidates = start[None] + at[..., None] * along
    nearest = np.argmin(np.sum((candidates - points[:, None]) ** 2, axis=2), axis=1)
    return candidates[np.arange(len(points)), nearest]


def closest_weights(points: Array, corners: Array) -> Array:
    """Weights ``(..., 3)`` of the points of triangles ``(..., 3, 3)`` closest to ``points`` (..., 3).

    Inside the triangle the plane's projection, otherwise the best of the three edges. By scalar products alone: curves
    ask this of a few points at a time, hundreds of times.
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
    return np.stack([np.maximum(1 - u - v, 0), u, v], axis=-1)  # rounding leaves -1e-17 on an edge
