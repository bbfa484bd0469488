"""The best rigid motion and similarity between two sets of corresponding points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError

__all__ = ["Similarity", "umeyama"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Similarity:
    """``x -> scale * rotation @ x + translation``: ``rotation`` (3, 3) proper, ``translation`` (3,)."""

    scale: float
    rotation: Array
    translation: Array

    def apply(self, points: NDArray[np.floating]) -> Array:
        """Map points ``(..., 3)``."""
        return self.scale * (np.asarray(points, dtype=np.float64) @ self.rotation.T) + self.translation

    def inverse(self) -> Similarity:
        """The similarity that undoes this one."""
        scale = 1.0 / self.scale
        return Similarity(scale, self.rotation.T, -scale * (self.rotation.T @ self.translation))

    def then(self, after: Similarity) -> Similarity:
        """The similarity that does this one first, ``after`` second."""
        return Similarity(
            after.scale * self.scale,
            after.rotation @ self.rotation,
            after.scale * (after.rotation @ self.translation) + after.translation,
        )


def umeyama(
    source: NDArray[np.floating],
    target: NDArray[np.floating],
    weights: NDArray[np.floating] | None = None,
    scale: bool = True,
) -> Similarity:
    """Least-squares similarity ``argmin sum_i w_i |s R source_i + t - target_i|^2`` (Umeyama 1991, Eqs. 34-42).

    Parameters
    ----------
    source: (N, 3) points, at least three that are not on one line
    target: (N, 3) where they should go
    weights: (N,) non-negative weights, ones by default
    scale: fit ``s``; otherwise it stays 1

    The rotation is always proper: a mirrored set is fitted as well as a rotation can, with a large residual.

    Raises
    ------
    InputError : shapes differ, values are not finite, or the points lie on a line (no rotation is determined)
    """
    x, y = np.asarray(source, dtype=np.float64), np.asarray(target, dtype=np.float64)
    w = _checked_weights(x, y, weights)
    mean_x, mean_y = w @ x, w @ y
    dx, dy = x - mean_x, y - mean_y
    covariance = (w[:, None] * dy).T @ dx
    left, singular, right = np.linalg.svd(covariance)
    if singular[1] <= 1e-12 * max(singular[0], np.finfo(float).tiny):
        raise InputError("the corresponding points lie on one line, so they fix no rotation", remedy="spread them out")
    signs = np.array([1.0, 1.0, 1.0 if np.linalg.det(left @ right) >= 0 else -1.0])
    rotation = (left * signs) @ right
    factor = float(singular @ signs / (w @ np.sum(dx * dx, axis=1))) if scale else 1.0
    return Similarity(factor, rotation, mean_y - factor * (rotation @ mean_x))


def _checked_weights(x: Array, y: Array, weights: NDArray[np.floating] | None) -> Array:
    if x.ndim != 2 or x.shape[1] != 3 or x.shape != y.shape:
        raise InputError(f"corresponding points must both be (N, 3), got {x.shape} and {y.shape}")
    w = np.ones(len(x)) if weights is None else np.asarray(weights, dtype=np.float64)
    if w.shape != (len(x),) or not np.all(w >= 0):
        raise InputError(f"weights must be {len(x)} numbers >= 0, got shape {w.shape}")
    if not (np.isfinite(x).all() and np.isfinite(y).all() and np.isfinite(w).all()):
        raise InputError("corresponding points and weights must be finite")
    if np.count_nonzero(w) < 3:
        raise InputError(f"{np.count_nonzero(w)} corresponding points with weight", remedy="at least 3 are needed")
    return w / w.sum()
