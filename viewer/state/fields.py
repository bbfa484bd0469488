"""Colour maps on a face: which there are, how their values are found, and their colours."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from toolkit.rendering.colormap import ColorScale

__all__ = ["MAPS", "Field", "scaled"]

MAPS: tuple[tuple[str, str], ...] = (
    ("none", "none"),
    ("difference", "difference before / after"),
    ("coating", "coating magnitude"),
    ("distance", "registration distance"),
)
_STEPS = 512
# A registration is only ever far off where the target ends.
_PERCENTILE = {"difference": 99.9, "coating": 98.5, "distance": 97.0}


@dataclass(frozen=True, eq=False)
class Field:
    """Values ``(V,)`` on a surface, not a number where there are none, with the ``scale`` that colours them."""

    values: NDArray[np.floating]
    scale: ColorScale

    def colors(self) -> NDArray[np.float32]:
        """Colours ``(V, 3)`` in 0..1; grey where there is no value."""
        share = (np.asarray(self.values, dtype=np.float32) - self.scale.low) / (self.scale.high - self.scale.low)
        known = np.isfinite(share)
        index = np.clip(np.where(known, share, 0) * (_STEPS - 1), 0, _STEPS - 1).astype(np.int32)
        colors = _table(self.scale.cmap)[index]
        colors[~known] = 0.45
        return colors


def scaled(name: str, values: NDArray[np.floating], unit: str, least: float = 0.0) -> Field:
    """A field of one of the maps, from zero to nearly its largest value, rounded, so that legends do not flicker.

    ``least`` keeps rounding errors from being spread over all colours.
    """
    label = dict(MAPS)[name]
    finite = values[np.isfinite(values)]
    high = float(np.percentile(finite, _PERCENTILE[name])) if len(finite) else 0.0
    high = max(high, least)
    return Field(values, ColorScale(0.0, _round_up(high), label, unit))


def _round_up(value: float) -> float:
    """The next of 1, 1.5, 2, 3, 5, 7 times a power of ten."""
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(step * power for step in (1, 1.5, 2, 3, 5, 7, 10) if step * power >= value * (1 - 1e-9)))


@lru_cache(maxsize=8)
def _table(cmap: str) -> NDArray[np.float32]:
    import matplotlib

    return np.asarray(matplotlib.colormaps[cmap](np.linspace(0, 1, _STEPS)), dtype=np.float32)[:, :3].copy()
