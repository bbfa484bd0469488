"""Text in images, in the one typeface that comes with our dependencies."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from PIL import ImageFont

__all__ = ["font", "text_width"]


@lru_cache(maxsize=32)
def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """Return DejaVu Sans at ``size`` pixels; matplotlib carries it, so every machine has the same."""
    import matplotlib

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / name), size)


def text_width(text: str, typeface: ImageFont.FreeTypeFont) -> int:
    """Width of a line of text in pixels."""
    return int(-(-typeface.getlength(text) // 1))
