"""The card of all keys: what each does, in two columns, as large as its words and no larger."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from toolkit.rendering.text import font, text_width

__all__ = ["Group", "draw_help"]

_PAPER, _RIM, _INK, _KEY, _TITLE = (24, 25, 29), (84, 88, 96), (226, 228, 232), (255, 204, 102), (150, 154, 162)
_TYPE, _LEAST_TYPE = 13, 7
_LINE, _PAD, _GUTTER = 1.65, 1.3, 2.4  # in heights of the type
_COLUMNS = 2


@dataclass(frozen=True)
class Group:
    """Keys that belong together: (key, what it does)."""

    title: str
    lines: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class _Measures:
    """Of a card whose type is ``size`` pixels high: each column's widths of keys and words, the whole card's size."""

    size: int
    keys: tuple[int, ...]
    words: tuple[int, ...]
    width: int
    height: int


def draw_help(groups: Sequence[Group], room: tuple[int, int], zoom: float = 1.0) -> NDArray[np.uint8]:
    """The picture ``(h, w, 3)`` uint8, no larger than ``room`` (width, height): where it is narrow the type shrinks."""
    columns = _columns(groups)
    sizes = range(round(_TYPE * zoom), _LEAST_TYPE - 1, -1)
    measured = (_measure(columns, size) for size in sizes)
    fits = next((m for m in measured if m.width <= room[0] and m.height <= room[1]), _measure(columns, _LEAST_TYPE))
    return _draw(columns, fits)[: room[1], : room[0]]


def _columns(groups: Sequence[Group]) -> list[list[Group]]:
    """Groups in their order, divided so that the longer column is as short as can be."""
    cuts = range(1, max(len(groups), 2))
    cut = min(cuts, key=lambda at: max(_rows(groups[:at]), _rows(groups[at:])))
    return [list(groups[:cut]), list(groups[cut:])]


def _rows(groups: Sequence[Group]) -> int:
    return sum(len(group.lines) + 2 for group in groups) - 1


def _measure(columns: Sequence[Sequence[Group]], size: int) -> _Measures:
    typeface = font(size)
    lines = [[line for group in column for line in group.lines] for column in columns]
    keys = tuple(max((text_width(key, typeface) for key, _ in part), default=0) for part in lines)
    words = tuple(max((text_width(text, typeface) for _, text in part), default=0) for part in lines)
    gaps = _COLUMNS * size + (_COLUMNS - 1) * _GUTTER * size
    width = round(sum(keys) + sum(words) + gaps + 2 * _PAD * size)
    height = round(max(map(_rows, columns)) * _LINE * size + 2 * _PAD * size)
    return _Measures(size, keys, words, width, height)


def _draw(columns: Sequence[Sequence[Group]], of: _Measures) -> NDArray[np.uint8]:
    image = Image.new("RGB", (of.width, of.height), _PAPER)
    pen = ImageDraw.Draw(image)
    pen.rectangle((0, 0, of.width - 1, of.height - 1), outline=_RIM)
    typeface, x = font(of.size), _PAD * of.size
    for column, keys, words in zip(columns, of.keys, of.words, strict=True):
        y = (_PAD + (_LINE - 1.2) / 2) * of.size
        for group in column:
            pen.text((x, y), group.title, font=font(of.size, bold=True), fill=_TITLE)
            for key, text in group.lines:
                y += _LINE * of.size
                pen.text((x, y), key, font=typeface, fill=_KEY)
                pen.text((x + keys + of.size, y), text, font=typeface, fill=_INK)
            y += 2 * _LINE * of.size
        x += keys + words + (1 + _GUTTER) * of.size
    return np.asarray(image)
