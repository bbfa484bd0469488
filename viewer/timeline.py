"""The time line as a picture, and what lies under a pixel of it: plain functions, drawn with Pillow.

From top to bottom: the window's strip with its two handles and the marks of edited frames, the ruler, the weight curves
of the chosen basis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from toolkit.rendering.text import font, text_width

__all__ = ["Drawer", "Layout", "Timeline", "at"]

_PAPER, _STRIP, _WINDOW = (24, 25, 28), (36, 38, 42), (62, 96, 140)
_INK, _FAINT, _HEAD = (198, 201, 207), (92, 96, 103), (255, 206, 84)
_SOURCE, _EDITED, _MARK, _HANDLE = (150, 156, 166), (255, 143, 31), (255, 143, 31), (150, 196, 255)
_GAIN = (92, 214, 120)


@dataclass(frozen=True)
class Layout:
    """Where things are, in pixels: a picture of ``width`` x ``height``, everything scaled by ``scale`` on HiDPI."""

    width: int
    height: int
    n_frames: int
    scale: float = 1.0

    @property
    def left(self) -> float:
        """The first frame's x."""
        return 16 * self.scale

    @property
    def right(self) -> float:
        """The last frame's x."""
        return max(self.width - 16 * self.scale, self.left + 1)

    @property
    def strip(self) -> tuple[float, float]:
        """The window's strip, top and bottom."""
        return 3 * self.scale, 17 * self.scale

    @property
    def ruler(self) -> tuple[float, float]:
        """The ruler, top and bottom."""
        return 17 * self.scale, 36 * self.scale

    @property
    def curves(self) -> tuple[float, float]:
        """The curves, top and bottom."""
        return 55 * self.scale, self.height - 4 * self.scale

    @property
    def title(self) -> float:
        """The top of the words over the curves."""
        return 39 * self.scale

    def x(self, frame: float) -> float:
        """Where a frame is."""
        return self.left + (self.right - self.left) * frame / max(self.n_frames - 1, 1)

    def frame(self, x: float) -> int:
        """The frame nearest to ``x``, held within the take."""
        share = (x - self.left) / (self.right - self.left)
        return int(np.clip(round(share * (self.n_frames - 1)), 0, self.n_frames - 1))


@dataclass(frozen=True)
class Timeline:
    """What is shown.

    ``frame``, the edit's ``window`` or None, ``marked`` how much edits change each frame (0..1), the chosen basis's
    weights of the source and edited, a title for the curves, and ``keys``, frames with a diamond. ``gain`` is another
    curve ``(T,)``, of an edit's gain, drawn to a scale of its own.
    """

    frame: int
    fps: float
    window: tuple[int, int] | None = None
    marked: Sequence[float] | NDArray[np.floating] = ()
    source: NDArray[np.floating] | None = None
    edited: NDArray[np.floating] | None = None
    title: str = ""
    keys: Sequence[int] = field(default=())
    gain: NDArray[np.floating] | None = None


def at(layout: Layout, window: tuple[int, int] | None, x: float, y: float) -> tuple[str, int]:
    """What a press at ``(x, y)`` takes hold of: ``("first" | "last" | "window" | "scrub", frame)``."""
    frame = layout.frame(x)
    if window is None or not layout.strip[0] <= y < layout.strip[1]:
        return "scrub", frame
    reach = 9 * layout.scale
    first, last = (abs(x - layout.x(end)) for end in window)
    # At the take's ends, and where both handles meet, the side of the press decides.
    if min(first, last) <= reach:
        if first == last:
            return ("first" if x < layout.x(window[0]) else "last"), frame
        return ("first" if first < last else "last"), frame
    return ("window" if window[0] < frame < window[1] else "scrub"), frame


class Drawer:
    """Draws, and keeps what does not change while it plays: all but the playhead."""

    def __init__(self) -> None:
        self._known: tuple[Layout, Timeline] | None = None
        self._still: Image.Image | None = None

    def draw(self, layout: Layout, shown: Timeline) -> NDArray[np.uint8]:
        """The picture ``(height, width, 3)`` uint8."""
        if self._still is None or self._known is None or not _same(self._known, (layout, shown)):
            self._still, self._known = _draw_still(layout, shown), (layout, shown)
        image = self._still.copy()
        _draw_head(ImageDraw.Draw(image), layout, shown)
        return np.asarray(image)


def _same(one: tuple[Layout, Timeline], other: tuple[Layout, Timeline]) -> bool:
    """Whether all but the frame is the same."""
    (layout, a), (other_layout, b) = one, other
    if layout != other_layout or (a.window, a.title, tuple(a.keys)) != (b.window, b.title, tuple(b.keys)):
        return False
    pairs = ((a.source, b.source), (a.edited, b.edited), (a.marked, b.marked), (a.gain, b.gain))
    return all(
        (p is None and q is None) or (p is not None and q is not None and np.array_equal(p, q)) for p, q in pairs
    )


def _draw_still(layout: Layout, shown: Timeline) -> Image.Image:
    image = Image.new("RGB", (layout.width, layout.height), _PAPER)
    pen = ImageDraw.Draw(image)
    _draw_strip(pen, layout, shown)
    _draw_ruler(pen, layout)
    if layout.curves[1] - layout.curves[0] > 12 * layout.scale:
        _draw_curves(pen, layout, shown)
    return image


def _draw_head(pen: ImageDraw.ImageDraw, layout: Layout, shown: Timeline) -> None:
    x = layout.x(shown.frame)
    pen.line((x, layout.strip[0], x, layout.height), fill=_HEAD, width=max(1, round(1.5 * layout.scale)))
    half = 5 * layout.scale
    pen.polygon([(x - half, layout.ruler[0]), (x + half, layout.ruler[0]), (x, layout.ruler[0] + 1.6 * half)], _HEAD)


def _draw_strip(pen: ImageDraw.ImageDraw, layout: Layout, shown: Timeline) -> None:
    top, bottom = layout.strip
    pen.rectangle((layout.left, top, layout.right, bottom), fill=_STRIP)
    if shown.window is not None:
        first, last = (layout.x(frame) for frame in shown.window)
        pen.rectangle((first, top, last, bottom), fill=_WINDOW)
        grip = 3 * layout.scale
        for x in (first, last):
            pen.rectangle((x - grip, top - 1, x + grip, bottom + 1), fill=_HANDLE)
    marked = np.asarray(shown.marked, dtype=np.float64)
    wide = max(1.0, (layout.right - layout.left) / max(layout.n_frames, 1))
    for index in np.flatnonzero(marked > 0):
        x = layout.x(float(index))
        tall = (0.25 + 0.75 * min(float(marked[index]), 1.0)) * (bottom - top - 4 * layout.scale)
        pen.rectangle((x - wide / 2, bottom - 1 - tall, x + wide / 2, bottom - 1), fill=_MARK)
    for frame in shown.keys:
        x, half = layout.x(frame), 4 * layout.scale
        middle = (top + bottom) / 2
        pen.polygon([(x, middle - half), (x + half, middle), (x, middle + half), (x - half, middle)], fill=_INK)


def _draw_ruler(pen: ImageDraw.ImageDraw, layout: Layout) -> None:
    typeface = font(round(11 * layout.scale))
    top, bottom = layout.ruler
    step = _step(layout)
    for frame in range(0, layout.n_frames, step):
        x = layout.x(frame)
        pen.line((x, top, x, top + 5 * layout.scale), fill=_FAINT)
        text = str(frame)
        wide = text_width(text, typeface)
        if x + wide / 2 <= layout.width:
            pen.text((max(x - wide / 2, 1), top + 5 * layout.scale), text, font=typeface, fill=_FAINT)
    pen.line((layout.left, bottom + 2, layout.right, bottom + 2), fill=_STRIP)


def _draw_curves(pen: ImageDraw.ImageDraw, layout: Layout, shown: Timeline) -> None:
    typeface = font(round(11 * layout.scale))
    top = layout.title
    weights = [curve for curve in (shown.source, shown.edited) if curve is not None and len(curve)]
    high = max((float(np.max(curve)) for curve in weights), default=0.0)
    for curve, color in ((shown.source, _SOURCE), (shown.edited, _EDITED)):
        if curve is not None:
            _draw_curve(pen, layout, curve, (0.0, max(high, 1e-9)), color)
    if shown.gain is not None and len(shown.gain):
        low, high = min(float(shown.gain.min()), 0.0), max(float(shown.gain.max()), 2.0)
        _draw_curve(pen, layout, np.ones(layout.n_frames), (low, high), _STRIP)  # at 1 nothing changes
        _draw_curve(pen, layout, shown.gain, (low, high), _GAIN)
        words = f"gain of the open edit: {low:g} to {high:g}"
        pen.text((layout.right - 3 - text_width(words, typeface), top), words, font=typeface, fill=_GAIN)
    if shown.title:
        pen.text((layout.left + 3, top), shown.title, font=typeface, fill=_INK)


def _draw_curve(
    pen: ImageDraw.ImageDraw,
    layout: Layout,
    values: NDArray[np.floating],
    limits: tuple[float, float],
    color: tuple[int, int, int],
) -> None:
    (top, bottom), (low, high) = layout.curves, limits
    heights = bottom - (bottom - top) * (np.asarray(values) - low) / (high - low)
    points = [(layout.x(frame), float(y)) for frame, y in enumerate(heights)]
    if len(points) > 1:
        pen.line(points, fill=color, width=max(1, round(1.4 * layout.scale)))


def _step(layout: Layout) -> int:
    """Frames between labels so that they don't touch."""
    room = 46 * layout.scale / max((layout.right - layout.left) / max(layout.n_frames - 1, 1), 1e-9)
    for step in (1, 2, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000):
        if step >= room:
            return step
    return 10000
