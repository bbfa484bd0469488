"""The weights' side of an edit: a bounded least squares problem over the window, banded in time.

With ``u = w' - w`` the change of the weights, ``(n, K)`` over the window's n frames,

    min_u  sum_k u_k^T Q u_k + sum_t u_t^T (G + H_t) u_t + (r - B u)^T M^-1 (r - B u),    u >= -w

``Q`` holds what changes in time cost, ``G`` what moving the fixed vertices costs, the diagonal ``H_t`` what opening
closed lids and lips costs, ``B`` how the few constrained frames answer. `toolkit.bounded` solves it; each of its steps
is one banded factorisation, the few rows of ``B`` by Woodbury's formula.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.banded import Bands, ChainBands, FrameBands, FrameRows
from toolkit.bounded import minimise
from toolkit.pose_edit.system import SmallFactor, System

__all__ = ["WeightsProblem", "time_matrix"]

Array = NDArray[np.float64]

# A gain, as a share of the energy, that is not worth a solve with bounds.
_NOTHING = 1e-3


@lru_cache(maxsize=8)
def time_matrix(n: int, tied_before: bool, tied_after: bool, smoothness: float) -> sp.csr_matrix:
    """``Q`` (n, n): squared velocities (Eq. 13) and, times ``smoothness``^2 (frames), squared accelerations.

    Velocities alone leave kinks where the window begins, at the edited frame, and where it ends. A tied end borders on
    frames that do not change, so value and speed join there; an end that is the take's own is free. A faint pull
    to the unedited curve, 1 / n^2, settles what neither says (the paper's term leaves a constant free).
    """
    before, after = 2 * tied_before, 2 * tied_after
    total = before + n + after
    inside = slice(before, before + n)
    velocity = sp.csr_matrix(sp.diags([-1.0, 1.0], [0, 1], shape=(max(total - 1, 0), total)))[:, inside]
    acceleration = sp.csr_matrix(sp.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(max(total - 2, 0), total)))[:, inside]
    bent = smoothness**2 * (acceleration.T @ acceleration)
    return sp.csr_matrix(velocity.T @ velocity + bent + sp.identity(n) / n**2)


@dataclass(frozen=True)
class WeightsProblem:
    """What stays the same: ``time`` = Q (n, n), five bands, ``gram`` = G (K, K) or None, ``lower`` = -w (n, K).

    ``opening`` (n, K) is the diagonal of every H_t, or None.
    """

    time: sp.csr_matrix
    gram: Array | None
    lower: Array
    opening: Array | None = None

    @cached_property
    def bands(self) -> Bands:
        """The matrix of `cost`."""
        n_bases = self.lower.shape[1]
        bands: Bands = ChainBands(self.time, n_bases)
        if self.gram is not None:
            n = self.time.shape[0]
            bands = FrameBands([(self.time, np.eye(n_bases)), (sp.csr_matrix(sp.identity(n)), self.gram)])
        if self.opening is not None:
            bands.diagonal[:] += self.opening
        return bands

    def cost(self, change: Array) -> float:
        """What the change ``u`` (n, K) costs, constraints aside."""
        return float(np.sum(change * self.force(change)))

    def force(self, change: Array) -> Array:
        """``Q u + u G + H u``, (n, K)."""
        force = np.asarray(self.time @ change)
        if self.gram is not None:
            force += change @ self.gram
        if self.opening is not None:
            force += self.opening * change
        return force

    def solve(self, rows: FrameRows, goals: Array, metric: Array, start: Array) -> Array:
        """The best change (n, K) for goals ``r`` (R,) and metric ``M`` (R, R), beginning near ``start`` (n, K).

        The solution without bounds comes first: it often keeps to them, and it tells how much there is to gain. Where
        that is next to nothing, as with most of the face held, ``start`` is returned as it is.
        """
        energy = _Energy(self, rows, goals, metric)
        free = energy.system().solve(-energy.gradient(np.zeros_like(start)))
        if (free >= self.lower).all():
            return free
        now = energy(start)
        return start if now - energy(free) <= _NOTHING * now else minimise(energy, self.lower, start)


class _Energy:
    """What is minimised, half its gradient ``P u - B^T M^-1 (r - B u)``, and the linear systems of both."""

    def __init__(self, problem: WeightsProblem, rows: FrameRows, goals: Array, metric: Array) -> None:
        self._problem, self._rows, self._goals, self._metric = problem, rows, goals, metric
        self._factor = SmallFactor(metric)

    def __call__(self, change: Array) -> float:
        left = self._goals - self._rows.of(change)
        return self._problem.cost(change) + float(left @ self._pull(change))

    @property
    def diagonal(self) -> Array:
        """Of ``P`` (n, K)."""
        return self._problem.bands.diagonal

    def gradient(self, change: Array) -> Array:
        """Half of it, (n, K)."""
        return self._problem.force(change) - self._rows.spread(self._pull(change), change)

    def system(self, *, extra: Array | None = None, stuck: NDArray[np.bool_] | None = None) -> System:
        """``P + diag(extra) + B^T M^-1 B``, the identity for ``stuck`` weights."""
        return System(self._problem.bands, self._rows, self._metric, extra, stuck)

    def _pull(self, change: Array) -> Array:
        return self._factor.solve(self._goals - self._rows.of(change))
