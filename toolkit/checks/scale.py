"""Sizes and units of the two faces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.checks.findings import Finding

__all__ = ["check_scale", "unit_guess"]

_UNITS = {"metres": 1.0, "centimetres": 0.01, "millimetres": 0.001, "inches": 0.0254, "decimetres": 0.1}
_COMMON = tuple(_UNITS)
"""The likelier units first: of several pairs that fit a ratio, the likelier one is named."""

_NEVER_PAIRED = {"inches", "decimetres"}

ALIKE = 3.0
"""Two faces of one unit differ by less than this, busts and babies included."""

_SAME_FACE = 1.3
"""How well a ratio must fit a pair of units to name them."""


def check_scale(source: NDArray[np.float64], target: NDArray[np.float64], where: object = "") -> list[Finding]:
    """Say it if the two faces differ wildly in size; no fault, as the registration starts with a similarity.

    ``source`` (N, 3) and ``target`` (M, 3) are points that stand for the faces: their landmarks, or their vertices.
    """
    sizes = [float(np.linalg.norm(np.ptp(points, axis=0))) for points in (source, target)]
    if min(sizes) == 0:
        return []  # check_mesh and check_landmarks say this better
    ratio = sizes[1] / sizes[0]
    if 1 / ALIKE < ratio < ALIKE:
        return []
    what = f"the target is {ratio:.3g} times the size of the source{unit_guess(ratio)}"
    return [Finding("info", what + "; the result is in the target's unit", str(where))]


def unit_guess(ratio: float) -> str:
    """Return the likeliest pair of units for a ratio of sizes, e.g. " (metres against centimetres?)" for 0.01.

    The unit of the numerator comes first; empty where no pair of units fits.
    """
    fits = [
        (abs(np.log(ratio * _UNITS[a] / _UNITS[b])), _COMMON.index(a) + _COMMON.index(b), f" ({a} against {b}?)")
        for a in _COMMON
        for b in _COMMON
        if a != b and {a, b} != _NEVER_PAIRED
    ]
    near = [fit for fit in fits if fit[0] < np.log(_SAME_FACE)]
    return min(near, key=lambda fit: (fit[1], fit[0]))[2] if near else ""
