"""Convex quadratic programmes with lower bounds: ``min_x x^T A x - 2 b^T x, x >= lower``.

A primal-dual interior point method (Mehrotra's): 15 to 30 steps, each one factorisation of ``A`` and a diagonal, which
is cheap where ``A`` is banded (`toolkit.banded`). Active sets alone creep where what is sought bends slowly in time: it
leaves its bound one frame at a time. They finish, where the interior point leaves numbers next to their bounds, and
follow a drag, where few numbers come to a bound or leave it.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["LinearSystem", "Quadratic", "minimise"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

_MOST_STEPS = 60
_MOST_CORRECTIONS = 16
# Complementarity, as a share of its start, at which the interior point stops.
_CLOSE = 1e-15
# How far inside the bounds the interior point begins.
_INSIDE = 1e-2
# A number that is not farther beyond its bound is not beyond it, nor one held there in vain that would not move more.
_NOTHING = 1e-10


class LinearSystem(Protocol):
    """A factorised matrix."""

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side."""


class Quadratic(Protocol):
    """``x^T A x - 2 b^T x``, ``A`` positive definite; ``x`` an array of any shape, in units in which it is about 1."""

    @property
    def diagonal(self) -> Array:
        """Of ``A``, or of what makes up most of it."""

    def gradient(self, x: Array) -> Array:
        """Half of it, ``A x - b``."""

    def system(self, *, extra: Array | None = None, stuck: Bools | None = None) -> LinearSystem:
        """``A + diag(extra)``, the identity for what is ``stuck``."""


def minimise(quadratic: Quadratic, lower: Array, start: Array) -> Array:
    """The minimum with ``x >= lower``, beginning near ``start``; numbers at their bounds are exactly there."""
    # While a point is dragged, what was at its bound mostly stays there.
    found = _corrected(quadratic, lower, start <= lower, 0.5)
    if found is not None:
        return found
    inside, active = _interior_point(quadratic, lower, start)
    found = _corrected(quadratic, lower, active, 1.0)
    return np.where(active, lower, inside) if found is None else found


def _interior_point(quadratic: Quadratic, lower: Array, start: Array) -> tuple[Array, Bools]:
    """The minimum but for what keeps it just inside the bounds, and which numbers those are that are at theirs."""
    slack = np.maximum(start - lower, _INSIDE)
    slope = quadratic.gradient(lower + slack)
    force = np.maximum(slope, 0) + max(float(np.abs(slope).mean()), 1e-300)
    active = slack < force
    gap = float(np.mean(slack * force))
    goal = _CLOSE * gap
    for _ in range(_MOST_STEPS):
        if gap <= goal:
            break
        stiff = force / slack
        system = quadratic.system(extra=stiff)
        move = system.solve(-slope)
        push = -force - stiff * move
        length = _longest(move / slack, push / force)
        ahead = float(np.mean((slack + length * move) * (force + length * push)))
        # Second order: what the first step would leave of slack times force.
        short = (gap * (ahead / gap) ** 3 - move * push) / slack
        pull = short - slope
        move = system.solve(pull)
        push = short - force - stiff * move
        nearer, weaker = move / slack, push / force
        length = 0.995 * _longest(nearer, weaker)
        # The gradient is linear, and the system has just told what it makes of the move.
        slope = slope + length * (pull - stiff * move)
        slack, force = slack + length * move, force + length * push
        gap = float(np.mean(slack * force))
        # One of the two tends to zero, the way to the bound or the force that it takes: what falls faster (Tapia).
        active = nearer < weaker
    return lower + slack, active


def _longest(*changes: Array) -> float:
    """The longest step, at most 1, with which nothing positive falls below zero; ``changes`` as shares of it."""
    return 1 / max(1.0, *(-float(change.min(initial=0)) for change in changes))


def _corrected(quadratic: Quadratic, lower: Array, active: Bools, share: float) -> Array | None:
    """The minimum with the ``active`` numbers at their bounds, these corrected; None if some stay wrong.

    A correction has to leave no more wrong than this ``share`` of what the last one left.
    """
    most = float(active.size)
    for _ in range(_MOST_CORRECTIONS):
        bound = np.where(active, lower, 0.0)
        x = bound + quadratic.system(stuck=active).solve(np.where(active, 0.0, -quadratic.gradient(bound)))
        in_vain = active & (quadratic.gradient(x) < -_NOTHING * quadratic.diagonal)
        wrong = in_vain | (~active & (x < lower - _NOTHING))
        count = int(np.count_nonzero(wrong))
        if count == 0:
            return np.maximum(x, lower)
        if count > most:
            break
        most = share * count
        active = active ^ wrong
    return None
