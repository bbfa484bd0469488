"""When an edit acts: the frames in which the wrinkle is there, and how the edit comes and goes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from toolkit.detail_edit.region import Region
from toolkit.detail_edit.take import DetailTake
from toolkit.errors import InputError

__all__ = ["activation", "check_window", "find_window", "gain_curve"]

Array = NDArray[np.float64]


def find_window(take: DetailTake, region: Region, frame: int, threshold: float = 0.23) -> tuple[int, int]:
    """First and last frame round the key frame in which the region's details are ``threshold`` of the key frame's.

    ``sum_v w_v |d_t(v)| >= threshold sum_v w_v |d_tk(v)|``, on the details before any edit: a window must not jump
    when another edit is switched off. (The paper thresholds the coating, which is the Laplacian of this.)
    """
    check_frame(take, frame)

    def amount(t: int) -> float:
        lengths = np.linalg.norm(take.unedited(t, t, region.vertices)[0], axis=1)
        return float(region.weights @ lengths)

    asked = threshold * amount(frame)
    if not asked > 0:
        raise InputError(
            f"the region has no motion details in frame {frame}, so there is nothing to find a window by",
            remedy="choose a frame in which the wrinkle shows, or give the window",
        )
    first = last = frame
    while first > 0 and amount(first - 1) >= asked:
        first -= 1
    while last < take.n_frames - 1 and amount(last + 1) >= asked:
        last += 1
    return first, last


def activation(window: tuple[int, int], frame: int, n_frames: int) -> Array:
    """How much of an edit is there in each frame of its window, ``(m,)``: 1 at the key frame, falling to 0 outside.

    ``x^3 (10 - 15 x + 6 x^2)`` on either side: no jump in value, speed or acceleration. Where the window reaches an end
    of the take there is nothing to be continuous with, and it stays 1.
    """
    first, last = window
    t = np.arange(first, last + 1, dtype=np.float64)
    before = np.ones(len(t)) if first == 0 else (t - (first - 1)) / (frame - (first - 1))
    after = np.ones(len(t)) if last == n_frames - 1 else ((last + 1) - t) / ((last + 1) - frame)
    x = np.clip(np.minimum(before, after), 0, 1)
    return x**3 * (10 - 15 * x + 6 * x**2)


def gain_curve(gains: tuple[tuple[int, float], ...], n_frames: int) -> Array:
    """Gain of each frame ``(T,)``: monotone cubics between the given ones, so that nothing overshoots."""
    frames = np.array([frame for frame, _ in gains], dtype=np.float64)
    values = np.array([gain for _, gain in gains], dtype=np.float64)
    if len(frames) == 1:
        return np.full(n_frames, values[0])
    at = np.clip(np.arange(n_frames, dtype=np.float64), frames[0], frames[-1])
    return np.asarray(PchipInterpolator(frames, values)(at))


def check_frame(take: DetailTake, frame: int) -> None:
    """Raise ``InputError`` for a frame that the take does not have."""
    if not 0 <= frame < take.n_frames:
        raise InputError(f"there is no frame {frame}: they go from 0 to {take.n_frames - 1}")


def check_window(take: DetailTake, window: tuple[int, int], frame: int) -> None:
    """Raise ``InputError`` for a window outside the take, or without its key frame."""
    first, last = window
    check_frame(take, frame)
    if not 0 <= first <= frame <= last < take.n_frames:
        raise InputError(
            f"the window {first} to {last} does not fit key frame {frame} of a take of {take.n_frames} frames",
            remedy="the window must hold the key frame and lie within the take",
        )
