"""Pictures beside and above each other, with labels: contact sheets and the frames of a side-by-side video."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PilImage
from PIL import ImageDraw

from toolkit.errors import InputError
from toolkit.rendering.text import font, text_width

__all__ = ["Row", "contact_sheet", "side_by_side"]

Image = NDArray[np.uint8]

_PAPER = (14, 15, 17)
_INK = (226, 228, 232)
_DIM = (150, 154, 162)


@dataclass(frozen=True)
class Row:
    """One row of a contact sheet: a label and pictures (h, w, 3), all of one size."""

    label: str
    images: Sequence[Image]


def contact_sheet(rows: Sequence[Row], columns: Sequence[str] = (), title: str = "", gap: int = 6) -> Image:
    """Return all rows above each other ``(H, W, 3)``; every row has as many pictures as the first.

    The labels stand in a band at the left, turned by 90 degrees, ``columns`` above the pictures, ``title`` on top.
    """
    if not rows or not rows[0].images:
        raise InputError("a contact sheet needs at least one row with one picture")
    count = len(rows[0].images)
    for row in rows:
        if len(row.images) != count:
            raise InputError(f"row {row.label!r} has {len(row.images)} pictures, the first row has {count}")
        if any(picture.shape != row.images[0].shape for picture in row.images):
            raise InputError(f"the pictures of row {row.label!r} are not all of one size")
    width = max(row.images[0].shape[1] for row in rows)
    size = max(12, round(width / 20))
    band = round(2.2 * size) if any(row.label for row in rows) else gap
    head = (round(2.6 * size) if title else 0) + (round(1.9 * size) if columns else gap)
    heights = [row.images[0].shape[0] for row in rows]
    page = PilImage.new("RGB", (band + count * (width + gap), head + sum(heights) + gap * len(rows)), _PAPER)
    pen = ImageDraw.Draw(page)
    if title:
        pen.text((band, round(0.7 * size)), title, font=font(round(1.25 * size), bold=True), fill=_INK)
    for k, text in enumerate(columns[:count]):
        centre = band + k * (width + gap) + width / 2
        pen.text((centre - text_width(text, font(size)) / 2, head - 1.55 * size), text, font=font(size), fill=_DIM)
    y = head
    for row, height in zip(rows, heights, strict=True):
        _label_at_side(page, row.label, y, height, band, size)
        for k, picture in enumerate(row.images):
            page.paste(PilImage.fromarray(picture), (band + k * (width + gap), y))
        y += height + gap
    return np.asarray(page)


def side_by_side(images: Sequence[Image], labels: Sequence[str] = (), caption: str = "") -> Image:
    """Return pictures of one height beside each other, each with its label in its lower left corner."""
    if not images or any(picture.shape[0] != images[0].shape[0] for picture in images):
        raise InputError("pictures side by side must all have one height, and there must be one at least")
    page = PilImage.fromarray(np.concatenate(images, axis=1))
    pen = ImageDraw.Draw(page)
    size = max(11, round(images[0].shape[0] / 34))
    x = 0
    for k, picture in enumerate(images):
        if k < len(labels):
            pen.text((x + 0.8 * size, page.height - 1.9 * size), labels[k], font=font(size), fill=_INK)
        x += picture.shape[1]
    if caption:
        at = page.width - text_width(caption, font(size)) - 0.8 * size
        pen.text((at, page.height - 1.9 * size), caption, font=font(size), fill=_DIM)
    return np.asarray(page)


def _label_at_side(page: PilImage.Image, label: str, y: int, height: int, band: int, size: int) -> None:
    if not label:
        return
    typeface = font(size, bold=True)
    while size > 9 and text_width(label, typeface) > height - size:
        size -= 1
        typeface = font(size, bold=True)
    strip = PilImage.new("RGB", (height, band), _PAPER)
    at = ((height - text_width(label, typeface)) / 2, (band - 1.25 * size) / 2)
    ImageDraw.Draw(strip).text(at, label, font=typeface, fill=_INK)
    page.paste(strip.rotate(90, expand=True), (0, y))
