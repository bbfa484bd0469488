"""Errors and unrest of a take: how far from the known answer, does it tremble, is it still when the source is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Jitter", "MotionError", "jitter", "motion_error", "second_differences", "unrest"]

Array = NDArray[np.float64]
Frames = Iterable[NDArray[np.floating]]
"""Frames ``(V, 3)`` one after the other; an array ``(T, V, 3)``, memory-mapped or not, is one."""


@dataclass(frozen=True)
class MotionError:
    """Error of a result relative to the motion of the known answer.

    ``relative`` RMS of ``|result - truth|`` over RMS of ``|truth - rest|``, all frames and vertices; ``rms`` and
    ``largest`` the error in mesh units; ``per_frame`` (T,) RMS in mesh units.
    """

    relative: float
    rms: float
    largest: float
    per_frame: Array


def motion_error(
    result: Frames, truth: Frames, rest: NDArray[np.floating], vertices: NDArray[np.integer] | None = None
) -> MotionError:
    """Compare frames ``(V, 3)`` with the known answer; over ``vertices`` only, if given."""
    ids = np.arange(len(rest)) if vertices is None else vertices
    errors, motions, largest = [], [], 0.0
    for found, true in zip(result, truth, strict=True):
        true_points = np.asarray(true, dtype=np.float64)[ids]
        squared = np.sum((found[ids] - true_points) ** 2, axis=1)
        errors.append(float(squared.mean()))
        motions.append(float(np.sum((true_points - rest[ids]) ** 2, axis=1).mean()))
        largest = max(largest, float(squared.max()))
    rms = float(np.sqrt(np.mean(errors)))
    relative = rms / max(float(np.sqrt(np.mean(motions))), 1e-300)
    return MotionError(relative, rms, float(np.sqrt(largest)), np.sqrt(errors))


@dataclass(frozen=True)
class Jitter:
    """Second differences in time of a result beside its source's, both in the source's size.

    ``rms`` ratio of the RMS over vertices and frames, ``high`` ratio of the 95 % largest vertices' RMS.
    """

    rms: float
    high: float


def second_differences(frames: Frames) -> Array:
    """RMS over time of ``|x_(t+1) - 2 x_t + x_(t-1)|`` for each vertex, ``(V,)``, mesh units a frame squared."""
    before: list[Array] = []
    total, count = np.zeros(0), 0
    for frame in frames:
        before.append(np.asarray(frame, dtype=np.float64))
        if len(before) == 3:
            a, b, c = before
            squared = np.sum((a - 2 * b + c) ** 2, axis=1)
            total = squared if count == 0 else total + squared
            count += 1
            before.pop(0)
    if count == 0:
        return np.zeros(len(before[0]) if before else 0)
    return np.asarray(np.sqrt(total / count))


def jitter(source: Array, result: Array, scale: float) -> Jitter:
    """Compare two results of `second_differences` ``(V,)``; ``scale`` is the target's size over the source's."""
    small = 1e-300

    def ratio(measure: float, of: float) -> float:
        return measure / scale / max(of, small)

    rms = ratio(float(np.sqrt(np.mean(result**2))), float(np.sqrt(np.mean(source**2))))
    return Jitter(rms, ratio(float(np.percentile(result, 95)), float(np.percentile(source, 95))))


def unrest(frames: Frames) -> float:
    """Largest distance of any vertex in any frame from its place in the first, in mesh units: 0 if all is still."""
    first: Array | None = None
    largest = 0.0
    for frame in frames:
        points = np.asarray(frame, dtype=np.float64)
        if first is None:
            first = points
        largest = max(largest, float(np.sum((points - first) ** 2, axis=1).max()))
    return float(np.sqrt(largest))
