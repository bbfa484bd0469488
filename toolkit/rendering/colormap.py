"""Scalar fields on a surface as colours, and the bar that says what the colours mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image as PilImage
from PIL import ImageDraw

from toolkit.rendering.text import font, text_width

__all__ = ["ColorScale", "add_legend"]

_INK = (226, 228, 232)
_PAPER = (22, 23, 26)


@dataclass(frozen=True)
class ColorScale:
    """Maps values in ``low`` .. ``high`` to the colours of one matplotlib colour map; beyond, the ends' colours.

    ``label`` and ``unit`` are for the legend.
    """

    low: float
    high: float
    label: str = ""
    unit: str = ""
    cmap: str = "viridis"

    @classmethod
    def unsigned(
        cls, values: ArrayLike, label: str = "", unit: str = "", *, percentile: float = 99.0, cmap: str = "viridis"
    ) -> ColorScale:
        """From zero to the given percentile of ``values``: a few outliers do not wash out the picture."""
        finite = _finite(values)
        return cls(0.0, _positive(np.percentile(finite, percentile)), label, unit, cmap)

    @classmethod
    def signed(cls, values: ArrayLike, label: str = "", unit: str = "", *, percentile: float = 99.0) -> ColorScale:
        """Symmetric about zero, so that zero is the map's neutral middle."""
        reach = _positive(np.percentile(np.abs(_finite(values)), percentile))
        return cls(-reach, reach, label, unit, "coolwarm")

    def colors(self, values: ArrayLike) -> NDArray[np.uint8]:
        """Colours ``(..., 3)`` uint8 of ``values`` (...); what is not finite is grey."""
        import matplotlib

        field = np.asarray(values, dtype=np.float64)
        share = (field - self.low) / (self.high - self.low)
        rgb = matplotlib.colormaps[self.cmap](np.clip(np.nan_to_num(share), 0, 1), bytes=True)[..., :3]
        return np.where(np.isfinite(field)[..., None], rgb, np.uint8(128))

    def ticks(self) -> list[float]:
        """Between three and seven round numbers on the scale."""
        from matplotlib.ticker import MaxNLocator

        at = MaxNLocator(nbins=5, steps=[1, 2, 2.5, 5, 10]).tick_values(self.low, self.high)
        slack = 1e-9 * (self.high - self.low)
        return [float(t) for t in at if self.low - slack <= t <= self.high + slack]


def add_legend(image: NDArray[np.uint8], scale: ColorScale) -> NDArray[np.uint8]:
    """Return ``image`` (h, w, 3) with a strip below it that holds the colour bar, its ticks, label and unit."""
    width = image.shape[1]
    size = max(11, min(round(width / 34), 20))
    typeface = font(size)
    strip = PilImage.new("RGB", (width, round(size * 4.6)), _PAPER)
    pen = ImageDraw.Draw(strip)
    left, right = round(width * 0.08), round(width * 0.92)
    top, bottom = round(size * 1.9), round(size * 2.7)
    ramp = scale.colors(np.linspace(scale.low, scale.high, right - left))
    strip.paste(PilImage.fromarray(np.repeat(ramp[None], bottom - top, axis=0)), (left, top))
    caption = f"{scale.label} ({scale.unit})" if scale.unit else scale.label
    pen.text(((width - text_width(caption, typeface)) / 2, size * 0.4), caption, font=typeface, fill=_INK)
    for value in scale.ticks():
        x = left + (right - 1 - left) * (value - scale.low) / (scale.high - scale.low)
        pen.line((x, bottom, x, bottom + size * 0.3), fill=_INK)
        text = f"{value:.6g}"
        pen.text((x - text_width(text, typeface) / 2, bottom + size * 0.4), text, font=typeface, fill=_INK)
    return np.concatenate([image, np.asarray(strip)])


def _finite(values: ArrayLike) -> NDArray[np.float64]:
    field = np.asarray(values, dtype=np.float64).ravel()
    field = field[np.isfinite(field)]
    return field if len(field) else np.zeros(1)


def _positive(value: np.floating | float) -> float:
    """Guard against a field that is zero everywhere: a scale needs some width."""
    return float(value) if value > 0 else 1.0
