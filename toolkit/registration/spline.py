"""Thin-plate splines in space: the smoothest field through a few known displacements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

__all__ = ["ThinPlateSpline"]

Array = NDArray[np.float64]


class ThinPlateSpline:
    """Map of space ``f(x) = x A + b + sum_i |x - p_i| c_i`` with ``f(p_i) = q_i`` (Duchon 1977; kernel r in 3-D).

    Parameters
    ----------
    points : (N, 3) where the map is known; distinct, not all in one plane
    values : (N, 3) where they go
    smoothing : added to the kernel's diagonal, in the unit of length; 0 interpolates exactly

    The spline commutes with similarities of either side, so no unit enters.
    """

    def __init__(self, points: NDArray[np.floating], values: NDArray[np.floating], smoothing: float = 0.0) -> None:
        self.points = np.asarray(points, dtype=np.float64)
        self._centre = self.points.mean(axis=0)
        self._size = float(np.abs(self.points - self._centre).max()) or 1.0
        kernel = cdist(self.points, self.points) / self._size
        # The kernel r is conditionally *negative* definite: smoothing is subtracted.
        kernel -= np.diag(np.full(len(self.points), smoothing / self._size))
        self._system = self._saddle(kernel, self._affine(self.points))
        self._right = np.concatenate([np.asarray(values, dtype=np.float64), np.zeros((4, 3))])
        self._coefficients = np.linalg.solve(self._system, self._right)

    def __call__(self, points: NDArray[np.floating]) -> Array:
        """Map points ``(M, 3)``."""
        x = np.asarray(points, dtype=np.float64)
        radial, affine = np.split(self._coefficients, [len(self.points)])
        return (cdist(x, self.points) / self._size) @ radial + self._affine(x) @ affine

    def leave_one_out(self) -> Array:
        """How far each value is from the spline through all the others, ``(N, 3)``.

        For any interpolant linear in the values the residual is ``c_i / (K^-1)_ii`` (Rippa 1999): no refitting.
        """
        inverse = np.linalg.inv(self._system)
        n = len(self.points)
        return self._coefficients[:n] / np.diag(inverse)[:n, None]

    def _affine(self, x: Array) -> Array:
        return np.concatenate([(x - self._centre) / self._size, np.ones((len(x), 1))], axis=1)

    @staticmethod
    def _saddle(kernel: Array, affine: Array) -> Array:
        return np.block([[kernel, affine], [affine.T, np.zeros((4, 4))]])
