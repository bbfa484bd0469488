"""The weights' side of an edit: a bounded least squares problem over the window, banded in time.

With ``u = w' - w`` the change of the weights, ``(n, K)`` over the window's n frames,

    min_u  sum_k u_k^T Q u_k + sum_t u_t^T (G + H_t) u_t + (r - B u)^T M^-1 (r - B u),    u >= -w

``Q`` holds what changes in time cost, ``G`` what moving the fixed vertices costs, the diagonal ``H_t`` what opening
closed lids and lips costs, ``B`` how the few constrained frames answer. A primal-dual interior point method
(Mehrotra's): each of its 15 to 20 steps is one banded factorisation, the few rows of ``B`` by Woodbury's formula.
Active sets alone creep here, since a curve that bends slowly leaves zero one frame at a time; they finish, where the
interior point leaves weights next to zero, and follow a drag, where few weights come to zero or leave it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.pose_edit.banded import FrameRows, SmallFactor, System, chain_bands, frame_bands

__all__ = ["WeightsProblem", "time_matrix"]

Array = NDArray[np.float64]

_MOST_STEPS = 60
# Corrections of which weights are zero, from the last solution's and from the interior point's.
_FEW_CORRECTIONS = 5
_MOST_CORRECTIONS = 16
# A gain, as a share of the energy, that is not worth a solve with bounds.
_NOTHING = 1e-3
# Complementarity, as a share of its start, at which the interior point stops.
_CLOSE = 1e-9
# How far inside the bounds the interior point begins; weights are of order 1.
_INSIDE = 1e-2


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
    def bands(self) -> Array:
        """Lower bands of the matrix of `cost`, as `System` takes them."""
        n_bases = self.lower.shape[1]
        bands = chain_bands(self.time, n_bases) if self.gram is None else frame_bands(self.time, self.gram)
        if self.opening is not None:
            bands[0] += self.opening.reshape(bands[0].shape)
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
        gradient = _Gradient(self, rows, goals, metric)
        free = gradient.system().solve(-gradient(np.zeros_like(start)))
        if (free >= self.lower).all():
            return free
        now = gradient.energy(start)
        if now - gradient.energy(free) <= _NOTHING * now:
            return start
        # While a point is dragged, what was zero mostly stays so.
        change, settled = self._held(gradient, start <= self.lower, start, _FEW_CORRECTIONS)
        if settled:
            return change
        change, force = self._interior_point(gradient, start)
        pulled = float(np.abs(gradient(np.zeros_like(start))).max())
        active = change - self.lower < force / max(pulled, 1e-300)
        return self._held(gradient, active, change, _MOST_CORRECTIONS)[0]

    def _interior_point(self, gradient: _Gradient, start: Array) -> tuple[Array, Array]:
        """A change just inside the bounds, and the force that each bound takes."""
        slack = np.maximum(start - self.lower, _INSIDE)
        slope = gradient(self.lower + slack)
        force = np.maximum(slope, 0) + max(float(np.abs(slope).mean()), 1e-300)
        goal = _CLOSE * float(np.mean(np.abs(gradient(np.zeros_like(start)))))
        for _ in range(_MOST_STEPS):
            gap = float(np.mean(slack * force))
            if gap <= goal:
                break
            stiff = force / slack
            system = gradient.system(extra=stiff)
            move = system.solve(-slope)
            push = -force - stiff * move
            length = min(_longest(slack, move), _longest(force, push))
            ahead = float(np.mean((slack + length * move) * (force + length * push)))
            centre = gap * (ahead / gap) ** 3
            # Second order: what the first step would leave of slack times force.
            short = (centre - move * push) / slack
            pull = short - slope
            move = system.solve(pull)
            push = short - force - stiff * move
            length = 0.995 * min(_longest(slack, move), _longest(force, push))
            # The gradient is linear, and the system has just told what it makes of the move.
            slope = slope + length * (pull - stiff * move)
            slack, force = slack + length * move, force + length * push
        return self.lower + slack, force

    def _held(self, gradient: _Gradient, active: NDArray[np.bool_], near: Array, tries: int) -> tuple[Array, bool]:
        """The solution with the ``active`` weights at zero, these corrected a few times, and whether it is exact.

        ``near`` if that is better.
        """
        best, least = np.where(active, self.lower, near), gradient.energy(near)
        at_first = active.size
        for done in range(tries):
            bound = np.where(active, self.lower, 0.0)
            change = bound + gradient.system(stuck=active).solve(-gradient(bound))
            slope = gradient(change)
            wrong = (~active & (change < self.lower)) | (active & (slope < 0))
            count = int(np.count_nonzero(wrong))
            if count == 0:
                return change, True
            if count > at_first:
                break
            at_first = at_first if done else count
            active = active ^ wrong
        change = np.maximum(change, self.lower)
        return (change if gradient.energy(change) <= least else best), False


class _Gradient:
    """Half the gradient of the energy, ``P u - B^T M^-1 (r - B u)``, and its linear systems."""

    def __init__(self, problem: WeightsProblem, rows: FrameRows, goals: Array, metric: Array) -> None:
        self.problem, self.rows, self.goals, self.metric = problem, rows, goals, metric
        self._factor = SmallFactor(metric)

    def __call__(self, change: Array) -> Array:
        return self.problem.force(change) - self.rows.spread(self._pull(change), change)

    def energy(self, change: Array) -> float:
        """What is minimised."""
        left = self.goals - self.rows.of(change)
        return self.problem.cost(change) + float(left @ self._pull(change))

    def system(self, *, extra: Array | None = None, stuck: NDArray[np.bool_] | None = None) -> System:
        """``P + diag(extra) + B^T M^-1 B`` (n, K), where ``stuck`` weights cannot move."""
        return System(self.problem.bands, self.rows, self.metric, extra, stuck)

    def _pull(self, change: Array) -> Array:
        return self._factor.solve(self.goals - self.rows.of(change))


def _longest(values: Array, step: Array) -> float:
    """The longest step, at most 1, that keeps positive values from falling below zero."""
    return 1 / max(1.0, float((step / -values).max(initial=1)))
