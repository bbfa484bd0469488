"""The bar that says what a colour map's colours mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from toolkit.rendering.colormap import ColorScale
from toolkit.rendering.text import font, text_width

__all__ = ["draw_legend"]

_PAPER, _INK = (30, 31, 35), (226, 228, 232)


def draw_legend(scale: ColorScale, width: int, zoom: float = 1.0) -> NDArray[np.uint8]:
    """The picture ``(h, width, 3)`` uint8: label and unit, the bar, round numbers below it."""
    typeface = font(round(12 * zoom))
    pad, line = 8 * zoom, 16 * zoom
    image = Image.new("RGB", (width, round(3 * line + 1.2 * pad)), _PAPER)
    pen = ImageDraw.Draw(image)
    caption = f"{scale.label} ({scale.unit})" if scale.unit else scale.label
    pen.text((pad, 0.4 * pad), caption, font=typeface, fill=_INK)
    # The widest numbers are half outside the bar.
    left, right, top, bottom = round(2.2 * pad), round(width - 2.6 * pad), round(1.3 * line), round(2.0 * line)
    ramp = scale.colors(np.linspace(scale.low, scale.high, right - left))
    image.paste(Image.fromarray(np.repeat(ramp[None], bottom - top, axis=0)), (left, top))
    for value in scale.ticks():
        x = left + (right - 1 - left) * (value - scale.low) / (scale.high - scale.low)
        text = f"{value:.4g}"
        pen.line((x, bottom, x, bottom + 3 * zoom), fill=_INK)
        pen.text((x - text_width(text, typeface) / 2, bottom + 3 * zoom), text, font=typeface, fill=_INK)
    return np.asarray(image)
