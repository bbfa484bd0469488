"""The weights' side of an edit: a bounded least squares problem over the window, banded in time.

With ``u = w' - w`` the change of the weights, ``(n, K)`` over the window's n frames,

    min_u  sum_k u_k^T Q u_k + sum_t u_t^T G u_t + (r - B u)^T M^-1 (r - B u),    u >= -w

``Q`` holds what changes in time cost, ``G`` what moving the fixed vertices costs, ``B`` how the few constrained frames
answer. A primal-dual interior point method (Mehrotra's): each of its 15 to 20 steps is one banded factorisation, the
few rows of ``B`` by Woodbury's formula. Active sets alone creep here, since a curve that bends slowly leaves zero one
frame at a time; they only finish: weights that the interior point leaves next to zero become exactly zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded

from toolkit.compiled import njit

__all__ = ["FrameRows", "WeightsProblem", "time_matrix"]

Array = NDArray[np.float64]

_MOST_STEPS = 60
_MOST_CORRECTIONS = 2
# A gain, as a share of the energy, that is not worth a solve with bounds.
_NOTHING = 1e-3
# Complementarity, as a share of its start, at which the interior point stops.
_CLOSE = 1e-9
# How far inside the bounds the interior point begins; weights are of order 1.
_INSIDE = 1e-2


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
class FrameRows:
    """``B``: row a sees only frame ``frames[a]`` of the window, ``(B u)_a = local[a] . u[frames[a]]``, local (R, K)."""

    frames: NDArray[np.int64]
    local: Array

    def of(self, change: Array) -> Array:
        """``B u`` (R,)."""
        return np.asarray(np.einsum("ak,ak->a", self.local, change[self.frames]))

    def spread(self, values: Array, like: Array) -> Array:
        """``B^T values`` (n, K)."""
        result = np.zeros_like(like)
        np.add.at(result, self.frames, values[:, None] * self.local)
        return result


@dataclass(frozen=True)
class WeightsProblem:
    """What stays the same: ``time`` = Q (n, n), five bands, ``gram`` = G (K, K) or None, ``lower`` = -w (n, K)."""

    time: sp.csr_matrix
    gram: Array | None
    lower: Array

    @cached_property
    def bands(self) -> Array:
        """Lower bands of the matrix of `cost`; see `_bands`."""
        return _bands(self, len(self.lower))

    def cost(self, change: Array) -> float:
        """What the change ``u`` (n, K) costs, constraints aside."""
        return float(np.sum(change * self.force(change)))

    def force(self, change: Array) -> Array:
        """``Q u + u G``, (n, K)."""
        force = np.asarray(self.time @ change)
        return force if self.gram is None else force + change @ self.gram

    def solve(self, rows: FrameRows, goals: Array, metric: Array, start: Array) -> Array:
        """The best change (n, K) for goals ``r`` (R,) and metric ``M`` (R, R), beginning near ``start`` (n, K).

        The solution without bounds comes first: it often keeps to them, and it tells how much there is to gain. Where
        that is next to nothing, as with most of the face held, ``start`` is returned as it is.
        """
        gradient = _Gradient(self, rows, goals, metric)
        nothing = np.zeros_like(start)
        free = gradient.factorise(nothing).solve(-gradient(nothing))
        if (free >= self.lower).all():
            return free
        now = gradient.energy(start)
        if now - gradient.energy(free) <= _NOTHING * now:
            return start
        change, force = self._interior_point(gradient, start)
        pulled = float(np.abs(gradient(np.zeros_like(start))).max())
        active = change - self.lower < force / max(pulled, 1e-300)
        return self._finish(gradient, active, change)

    def _interior_point(self, gradient: _Gradient, start: Array) -> tuple[Array, Array]:
        """A change just inside the bounds, and the force that each bound takes."""
        slack = np.maximum(start - self.lower, _INSIDE)
        change = self.lower + slack
        slope = gradient(change)
        force = np.maximum(slope, 0) + max(float(np.abs(slope).mean()), 1e-300)
        goal = _CLOSE * float(np.mean(np.abs(gradient(np.zeros_like(start)))))
        for _ in range(_MOST_STEPS):
            gap = float(np.mean(slack * force))
            if gap <= goal:
                break
            system = gradient.factorise(force / slack)
            rest = gradient(change) - force
            move = system.solve(-rest - force)
            push = -force - force * move / slack
            length = min(_longest(slack, move), _longest(force, push))
            ahead = float(np.mean((slack + length * move) * (force + length * push)))
            centre = gap * (ahead / gap) ** 3
            # Second order: what the first step would leave of slack times force.
            short = (centre - move * push) / slack
            move = system.solve(-rest - force + short)
            push = short - force - force * move / slack
            length = 0.995 * min(_longest(slack, move), _longest(force, push))
            slack, force = slack + length * move, force + length * push
            change = self.lower + slack
        return change, force

    def _finish(self, gradient: _Gradient, active: NDArray[np.bool_], near: Array) -> Array:
        """The exact solution with some weights at zero, these corrected a few times; ``near`` if that is better."""
        best, least = np.where(active, self.lower, near), gradient.energy(near)
        for _ in range(_MOST_CORRECTIONS):
            bound = np.where(active, self.lower, 0.0)
            change = bound + gradient.factorise(np.where(active, np.inf, 0.0)).solve(-gradient(bound))
            slope = gradient(change)
            wrong = (~active & (change < self.lower)) | (active & (slope < 0))
            if not wrong.any():
                break
            active = active ^ wrong
        change = np.maximum(change, self.lower)
        return change if gradient.energy(change) <= least else best


class _Gradient:
    """Half the gradient of the energy, ``P u - B^T M^-1 (r - B u)``, and its linear systems."""

    def __init__(self, problem: WeightsProblem, rows: FrameRows, goals: Array, metric: Array) -> None:
        self.problem, self.rows, self.goals, self.metric = problem, rows, goals, metric

    def __call__(self, change: Array) -> Array:
        pull = _solved(self.metric, self.goals - self.rows.of(change))
        return self.problem.force(change) - self.rows.spread(pull, change)

    def energy(self, change: Array) -> float:
        """What is minimised."""
        left = self.goals - self.rows.of(change)
        return self.problem.cost(change) + float(left @ _solved(self.metric, left))

    def factorise(self, extra: Array) -> _System:
        """``P + diag(extra) + B^T M^-1 B``, extra (n, K); infinite where a weight cannot move."""
        return _System(self.problem, self.rows, self.metric, extra)


class _System:
    """The banded part factorised, the rows by Woodbury's formula."""

    def __init__(self, problem: WeightsProblem, rows: FrameRows, metric: Array, extra: Array) -> None:
        stuck = np.isinf(extra)
        self._open, self._by_basis = ~stuck, problem.gram is None
        self._shape = extra.shape
        self._rows = FrameRows(rows.frames, np.where(stuck[rows.frames], 0.0, rows.local))
        free = self._flat(self._open)
        bands = problem.bands.copy()
        bands[0] += np.where(free, self._flat(np.where(stuck, 0.0, extra)), 0.0)
        for offset in range(len(bands)):
            length = max(len(free) - offset, 0)
            bands[offset, :length] *= free[:length] & free[len(free) - length :]
        bands[0, ~free] = 1
        if self._by_basis:
            _factorise_chains(bands)
            self._factor = bands
        else:
            factor = cholesky_banded(bands, overwrite_ab=True, lower=True, check_finite=False)
            self._factor = np.ascontiguousarray(factor.T)
        if self._by_basis:
            self._small = metric + self._answers()
        else:
            self._halves = self._half_answers()
            self._small = metric + self._halves.T @ self._halves

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side (n, K); what cannot move stays zero."""
        masked = np.where(self._open, right, 0.0)
        if self._by_basis:
            alone = self._chains(masked)
            pull = _solved(self._small, self._rows.of(alone))
            return alone - self._chains(self._rows.spread(pull, alone))
        half = np.array(masked.reshape(-1, 1))
        _forward(self._factor, half, 0)
        half[:, 0] -= self._halves @ _solved(self._small, self._halves.T @ half[:, 0])
        _backward(self._factor, half)
        return half.reshape(self._shape)

    def _answers(self) -> Array:
        """``B P^-1 B^T`` (R, R), basis by basis."""
        rows, (n, n_bases) = self._rows, self._shape
        frames, at = np.unique(rows.frames, return_inverse=True)
        units = np.zeros((n_bases, n, len(frames)))
        units[:, frames, np.arange(len(frames))] = 1
        solved = units.reshape(-1, len(frames))
        _substitute_chains(self._factor, solved)
        between = solved.reshape(n_bases, n, -1)[:, frames][:, at][:, :, at]  # (K, R, R)
        return np.asarray(np.einsum("ak,kab,bk->ab", rows.local, between, rows.local))

    def _half_answers(self) -> Array:
        """``L^-1 B^T`` (n K, R), with ``P = L L^T``: half the way to ``B P^-1 B^T``, and all that is needed."""
        rows, (n, n_bases) = self._rows, self._shape
        pulls = np.zeros((n, n_bases, len(rows.frames)))
        pulls[rows.frames, :, np.arange(len(rows.frames))] = rows.local
        halves = pulls.reshape(n * n_bases, -1)
        _forward(self._factor, halves, int(rows.frames.min(initial=0)) * n_bases)
        return halves

    def _chains(self, right: Array) -> Array:
        solved = np.array(self._flat(right)[:, None], order="C")
        _substitute_chains(self._factor, solved)
        return np.asarray(solved.reshape(self._shape[::-1]).T)

    def _flat(self, array: NDArray) -> NDArray:
        return array.T.ravel() if self._by_basis else array.ravel()


def _bands(problem: WeightsProblem, n: int) -> Array:
    """Lower bands of ``P``.

    Without fixed vertices each weight's curve is a chain of its own, so basis by basis: three bands. With them, frame
    by frame: the fixed vertices couple the weights of a frame, time couples a frame with the next two.
    """
    n_bases = problem.lower.shape[1]
    time = [np.pad(problem.time.diagonal(offset), (0, min(offset, n))) for offset in range(3)]
    if problem.gram is None:
        return np.stack([np.tile(band, n_bases) for band in time])
    bands = np.zeros((2 * n_bases + 1, n * n_bases))
    for offset in range(n_bases):
        bands[offset] = np.tile(np.pad(np.diagonal(problem.gram, offset), (0, offset)), n)
    for step, band in enumerate(time):
        bands[step * n_bases] += np.repeat(band, n_bases)
    return bands


@njit(cache=True, nogil=True)
def _factorise_chains(bands):  # type: ignore[no-untyped-def]  # compiled
    """``L D L^T`` of five bands, in place: (3, N) becomes D and L's two diagonals. LAPACK is far slower."""
    diagonal, first, second = bands[0], bands[1], bands[2]
    for i in range(diagonal.shape[0]):
        if i >= 2:
            diagonal[i] -= second[i - 2] ** 2 * diagonal[i - 2]
        if i >= 1:
            first[i] -= second[i - 1] * diagonal[i - 1] * first[i - 1]
            diagonal[i] -= first[i - 1] ** 2 * diagonal[i - 1]
        first[i] /= diagonal[i]
        second[i] /= diagonal[i]


@njit(cache=True, nogil=True)
def _substitute_chains(factor, columns):  # type: ignore[no-untyped-def]  # compiled
    """Solve in place for ``columns`` (N, C)."""
    diagonal, first, second = factor[0], factor[1], factor[2]
    n, count = columns.shape
    for i in range(n):
        for c in range(count):
            if i >= 1:
                columns[i, c] -= first[i - 1] * columns[i - 1, c]
            if i >= 2:
                columns[i, c] -= second[i - 2] * columns[i - 2, c]
    for i in range(n - 1, -1, -1):
        for c in range(count):
            columns[i, c] /= diagonal[i]
            if i + 1 < n:
                columns[i, c] -= first[i] * columns[i + 1, c]
            if i + 2 < n:
                columns[i, c] -= second[i] * columns[i + 2, c]


@njit(cache=True, nogil=True)
def _forward(factor, columns, first):  # type: ignore[no-untyped-def]  # compiled
    """``L^-1 columns`` (N, C) in place, from row ``first`` on; ``factor`` (N, W) holds L's columns, diagonal first."""
    n, width = factor.shape
    count = columns.shape[1]
    for i in range(first, n):
        for c in range(count):
            columns[i, c] /= factor[i, 0]
        for j in range(1, min(width, n - i)):
            for c in range(count):
                columns[i + j, c] -= factor[i, j] * columns[i, c]


@njit(cache=True, nogil=True)
def _backward(factor, columns):  # type: ignore[no-untyped-def]  # compiled
    """``L^-T columns`` (N, C) in place."""
    n, width = factor.shape
    count = columns.shape[1]
    for i in range(n - 1, -1, -1):
        for j in range(1, min(width, n - i)):
            for c in range(count):
                columns[i, c] -= factor[i, j] * columns[i + j, c]
        for c in range(count):
            columns[i, c] /= factor[i, 0]


def _solved(matrix: Array, right: Array) -> Array:
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)


def _longest(values: Array, step: Array) -> float:
    """The longest step, at most 1, that keeps the values from falling below zero."""
    falling = step < 0
    return min(1.0, float((-values[falling] / step[falling]).min(initial=np.inf)))
