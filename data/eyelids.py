"""Eyes that close: how much of an eye-closure offset each part of the lids takes so that the rims just meet."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from data.layout import Layout
from data.rims import Opening

__all__ = ["closed_lids"]

Array = NDArray[np.float64]

_KNOTS = 41
_STEPS = 24
_LARGEST = 1.6
_SNAPS = 12
_UPPER_SHARE = 0.35
"""Share of the depth gap that the upper lid takes: the lower lid may come forward, behind the upper is the eye."""


def closed_lids(layout: Layout, neutral: Array, closure: Array, side: str) -> Array:
    """Offsets ``(V, 3)`` that bring the upper lid's rim onto the lower one, from MakeHuman's ``closure`` (V, 3).

    The closure is weighted by a curve s(x) of 41 knots between the eye's corners: Newton-like steps drive the height
    of the gap between the *subdivided* rims to zero at every knot. The upper rim then still lies up to 3 mm in front
    of the lower one; a second curve, fading over the rings round the rim, takes that depth away. Last, what is left
    near the corners, where the rims run in depth, is closed by moving both rims to their closest points.
    """
    lids = _Lids(layout, neutral, side)
    height, depth = np.full(_KNOTS, 0.85), np.zeros(_KNOTS)
    for _ in range(_STEPS):
        offsets = lids.offsets(closure, height, depth)
        upper, lower = lids.upper @ (neutral + offsets), lids.lower @ (neutral + offsets)
        gap = lids.at_knots(upper, upper) - lids.at_knots(lower, lower)
        speed = lids.at_knots(lower, lids.lower @ closure)[:, 1] - lids.at_knots(upper, lids.upper @ closure)[:, 1]
        height = np.clip(_smooth(height + 0.8 * gap[:, 1] / np.maximum(speed, 0.25 * speed.max())), 0, _LARGEST)
        depth = _smooth(depth + 0.8 * gap[:, 2])
    offsets = lids.offsets(closure, height, depth)
    for _ in range(_SNAPS):
        offsets = offsets + lids.opening.closing(neutral + offsets)
    return offsets


class _Lids:
    """One eye's opening, and curves over x between its corners."""

    def __init__(self, layout: Layout, neutral: Array, side: str) -> None:
        self.opening = Opening(layout, f"eye_{side}", f"eyelid_rim_{side}", f"eyelid_{side}", _UPPER_SHARE)
        self.upper, self.lower = self.opening.upper, self.opening.lower
        corners = np.sort((self.upper @ neutral)[[0, -1], 0])
        self.knots = np.linspace(corners[0], corners[1], _KNOTS)
        self.x = neutral[:, 0]
        self.depth_share = np.asarray(self.opening.follows.sum(1)).ravel()

    def offsets(self, closure: Array, height: Array, depth: Array) -> Array:
        offsets = np.interp(self.x, self.knots, height)[:, None] * closure
        offsets[:, 2] += self.depth_share * np.interp(self.x, self.knots, depth)
        return offsets

    def at_knots(self, rim: Array, values: Array) -> Array:
        """Interpolate ``values`` (n, 3), which belong to the rim's vertices, at the knots' x."""
        order = np.argsort(rim[:, 0], kind="stable")
        return np.stack([np.interp(self.knots, rim[order, 0], values[order, k]) for k in range(3)], axis=1)


def _smooth(curve: Array) -> Array:
    padded = np.pad(curve, 1, mode="edge")
    return 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]
