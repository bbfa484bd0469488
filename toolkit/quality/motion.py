"""Errors and unrest of a take: how far from the known answer, does it tremble, is it still when the source is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

__all__ = [
    "Jitter",
    "MotionError",
    "Unsteadiness",
    "face_parts",
    "jitter",
    "motion_error",
    "unexplained_trembling",
    "unrest",
    "unsteadiness",
]

Array = NDArray[np.float64]
Frames = Iterable[NDArray[np.floating]]
"""Frames ``(V, 3)`` one after the other; an array ``(T, V, 3)``, memory-mapped or not, is one."""


_DIFFERENCES = {1: (-1, 1), 2: (1, -2, 1), 4: (1, -4, 6, -4, 1)}
_SEEN = 1e-5
"""A part moves if it does by this share of the face's height a frame: 2 micrometres on a face."""
_TINY = 1e-300
_HELD = 0.9999


@dataclass(frozen=True)
class MotionError:
    """Error of a result relative to the motion of the known answer.

    ``relative`` RMS of ``|result - truth|`` over RMS of ``|truth - rest|``, all frames and vertices; ``rms`` and
    ``largest`` the error in mesh units.
    """

    relative: float
    rms: float
    largest: float


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
    return MotionError(relative, rms, float(np.sqrt(largest)))


@dataclass(frozen=True)
class Unsteadiness:
    """RMS over time of each vertex's differences from frame to frame, mesh units: ``(V,)`` each.

    ``speed`` of the first differences, ``bend`` of the second, ``shiver`` of the fourth, in which what trembles from
    frame to frame stands out most: white noise counts sqrt(35) times as much in it as in the speed, a motion over ten
    frames a quarter as much.
    """

    speed: Array
    bend: Array
    shiver: Array


@dataclass(frozen=True)
class Jitter:
    """How much a result trembles beside its source; 1 for as much, as a larger but otherwise equal motion has.

    ``whole`` ratio of shiver over speed, over all vertices: what is left after scaling by how much each face moves;
    ``typical`` and ``worst`` the same for the median and the 90 % worst of the face's parts that are seen to move, so
    that a calm forehead is not judged by a busy mouth; ``bend`` plain ratio of second differences, scaled by the
    faces' size alone, in which larger motion counts as unrest: a lid that has farther to close, a longer jaw;
    ``paced`` the same, but each vertex scaled by how fast it moves on either face.
    """

    whole: float
    typical: float
    worst: float
    bend: float
    paced: float


def unsteadiness(frames: Frames) -> Unsteadiness:
    """Measure a take, frames ``(V, 3)``. Without the head's motion: it would be the largest part of every speed."""
    held: list[Array] = []
    totals: dict[int, Array] = {}
    counts = dict.fromkeys(_DIFFERENCES, 0)
    n_vertices = 0
    for frame in frames:
        held = [*held[-4:], np.asarray(frame, dtype=np.float64)]
        n_vertices = len(frame)
        for order, factors in _DIFFERENCES.items():
            if len(held) > order:
                difference = sum(factor * points for factor, points in zip(factors, held[-order - 1 :], strict=True))
                squared = np.einsum("vi,vi->v", difference, difference)
                totals[order] = totals.get(order, 0) + squared
                counts[order] += 1
    speed, bend, shiver = (
        np.sqrt(totals[order] / counts[order]) if counts[order] else np.zeros(n_vertices) for order in _DIFFERENCES
    )
    return Unsteadiness(speed, bend, shiver)


def jitter(
    source: Unsteadiness, result: Unsteadiness, scale: float, rest: NDArray[np.floating], height: float
) -> Jitter:
    """Compare a result with its source.

    ``scale`` is the target's size over the source's, ``rest`` (V, 3) and ``height`` the source's neutral and its
    face's height. Parts count that move by more than 1e-5 of the height a frame, on either face.
    """
    parts = face_parts(rest)
    here, there = (_by_part(take, parts, size) for take, size in ((source, 1.0), (result, scale)))
    least = _SEEN * height
    moves = np.maximum(here.speed, there.speed) > least
    whole = _rms(source.shiver) / max(_rms(source.speed), _TINY)
    if _rms(source.shiver) <= 1e-9 * height or not moves.any():  # it stands still, but for rounding
        none = 1.0 if _rms(result.shiver) <= least * scale else float("inf")
        return Jitter(none, none, none, none, none)
    # A part that is still on the source is held against the source's face as a whole.
    share = np.where(here.speed > least, here.shiver / np.maximum(here.speed, _TINY), whole)
    ratios = (there.shiver / np.maximum(there.speed, _TINY) / np.maximum(share, _TINY))[moves]
    return Jitter(
        _rms(result.shiver) / max(_rms(result.speed), _TINY) / whole,
        float(np.median(ratios)),
        float(np.percentile(ratios, 90)),
        _rms(result.bend) / scale / _rms(source.bend),
        _rms(result.bend * source.speed / np.maximum(result.speed, _TINY)) / _rms(source.bend),
    )


def unexplained_trembling(source: NDArray[np.floating], result: NDArray[np.floating]) -> float:
    """Share of a result's fourth differences that no motion of its source explains, 0..1.

    ``source``, ``result`` (T, V, 3), without the head's motion; an even choice of vertices is enough. The source's
    motion is some curves over time, those of its principal components that hold 99.99 % of it. Whatever a transfer
    that is linear does with them, larger, smaller or somewhere else, is made of the same curves; weights that jump,
    noise and fits that flicker are not. Give the source twice for its own share.
    """
    flat = np.asarray(source, dtype=np.float64).reshape(len(source), -1)
    centred = flat - flat.mean(axis=0)
    energy, curves = np.linalg.eigh(centred @ centred.T)
    held = np.cumsum(energy[::-1]) / max(float(energy.sum()), _TINY)
    count = int(np.searchsorted(held, _HELD)) + 1
    known = np.linalg.qr(np.column_stack([np.ones(len(flat)), curves[:, ::-1][:, :count]]))[0]
    moved = np.asarray(result, dtype=np.float64).reshape(len(result), -1)
    left = moved - known @ (known.T @ moved)
    trembling = _rms(np.diff(moved, n=4, axis=0))
    return _rms(np.diff(left, n=4, axis=0)) / trembling if trembling > 0 else 0.0


def face_parts(rest: NDArray[np.floating], count: int = 60) -> NDArray[np.int64]:
    """Part 0..count-1 of each vertex ``(V,)`` of a face (V, 3): the nearest of so many points spread evenly on it."""
    points = np.asarray(rest, dtype=np.float64)
    seeds = [0]
    distance = np.linalg.norm(points - points[0], axis=1)
    while len(seeds) < min(count, len(points)):
        seeds.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[seeds[-1]], axis=1))
    return np.asarray(cKDTree(points[seeds]).query(points)[1], dtype=np.int64)


def _by_part(take: Unsteadiness, parts: NDArray[np.int64], scale: float) -> Unsteadiness:
    sizes = np.bincount(parts)
    mean = (np.bincount(parts, x**2) / np.maximum(sizes, 1) for x in (take.speed, take.bend, take.shiver))
    return Unsteadiness(*(np.sqrt(square) / scale for square in mean))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else 0.0


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
