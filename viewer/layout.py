"""Where things are in the window, in its pixels: sizes come from the type's, so that dense screens show the same."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["PANEL", "Places", "Rectangle", "arrange"]

PANEL = 24.0
"""The panel's width, in heights of the type (em), as all sizes here."""
_BUTTONS, _TIMES, _STATUS = 2.1, 7.0, 1.9
_PROGRESS, _CANCEL = 11.0, 4.5
_LEGEND = (17.0, 3.6)
_LEAST_WIDTH, _LEAST_HEIGHT = 12.0, 6.0


@dataclass(frozen=True)
class Rectangle:
    """In pixels, y downwards."""

    x: int
    y: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """Where it ends."""
        return self.x + self.width

    @property
    def bottom(self) -> int:
        """Where it ends."""
        return self.y + self.height

    def middle(self, width: int, height: int) -> Rectangle:
        """A smaller one in its middle."""
        return Rectangle(self.x + (self.width - width) // 2, self.y + (self.height - height) // 2, width, height)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        return self.width, self.height


@dataclass(frozen=True)
class Places:
    """Of the two panes and their titles, the colour map's legend, the panel, the time line, and the bottom line.

    ``help`` is where the card of keys finds room: over the panes, never over what plays the take.
    """

    panes: tuple[Rectangle, Rectangle]
    titles: tuple[Rectangle, Rectangle]
    legend: Rectangle
    help: Rectangle
    panel: Rectangle
    buttons: Rectangle
    times: Rectangle
    floor: Rectangle
    status: Rectangle
    progress: Rectangle
    cancel: Rectangle


def arrange(whole: Rectangle, em: float) -> Places:
    """Divide the window, or what of it is for us, at a type of ``em`` pixels."""
    side = round(PANEL * em)
    width = max(whole.width - side, round(_LEAST_WIDTH * em))
    status, times, buttons = (round(part * em) for part in (_STATUS, _TIMES, _BUTTONS))
    height = max(whole.height - status - times - buttons, round(_LEAST_HEIGHT * em))
    half, low = width // 2, whole.y + height
    left = Rectangle(whole.x, whole.y, half - 1, height)
    right = Rectangle(whole.x + half + 1, whole.y, width - half - 1, height)
    floor = Rectangle(whole.x, low + buttons + times, whole.width, status)
    bar, button = round(_PROGRESS * em), round(_CANCEL * em)
    return Places(
        (left, right),
        (_title(left, em), _title(right, em)),
        _legend(right, em),
        Rectangle(whole.x, whole.y, width, height),
        Rectangle(whole.x + width, whole.y, side, max(whole.height - status, height)),
        Rectangle(whole.x, low, width, buttons),
        Rectangle(whole.x, low + buttons, width, times),
        floor,
        Rectangle(floor.x + round(0.5 * em), floor.y, max(floor.width - bar - button - round(em), 1), status),
        Rectangle(
            floor.right - bar - button, floor.y + round(0.4 * em), bar - round(0.5 * em), status - round(0.8 * em)
        ),
        Rectangle(floor.right - button, floor.y + round(0.15 * em), button - round(0.5 * em), status - round(0.3 * em)),
    )


def _title(pane: Rectangle, em: float) -> Rectangle:
    return Rectangle(
        pane.x + round(0.6 * em), pane.y + round(0.3 * em), max(pane.width - round(em), 1), round(1.6 * em)
    )


def _legend(pane: Rectangle, em: float) -> Rectangle:
    """In the pane's lower right corner, no wider than the pane."""
    margin = round(0.6 * em)
    width, height = min(round(_LEGEND[0] * em), max(pane.width - 2 * margin, 1)), round(_LEGEND[1] * em)
    return Rectangle(pane.right - width - margin, pane.bottom - height - margin, width, height)
