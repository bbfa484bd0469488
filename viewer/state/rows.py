"""What a mode wants in the panel: rows of plain values. The view sends a `PanelInput` with their name."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Button", "Buttons", "Check", "Choice", "Entry", "Heading", "Items", "Note", "Number", "Row", "Slider"]


@dataclass(frozen=True)
class Heading:
    """A title between groups."""

    text: str


@dataclass(frozen=True)
class Note:
    """Words to read; ``tone`` is plain, quiet, good or bad."""

    text: str
    tone: str = "plain"


@dataclass(frozen=True)
class Button:
    """Sends its name; ``on`` (not None) makes it a switch and says whether it is pressed down."""

    name: str
    text: str
    enabled: bool = True
    on: bool | None = None


@dataclass(frozen=True)
class Buttons:
    """Buttons side by side."""

    buttons: tuple[Button, ...]


@dataclass(frozen=True)
class Check:
    """Sends True or False."""

    name: str
    text: str
    on: bool


@dataclass(frozen=True)
class Choice:
    """Sends the chosen option's name; ``options`` are (name, words)."""

    name: str
    text: str
    options: tuple[tuple[str, str], ...]
    chosen: str


@dataclass(frozen=True)
class Slider:
    """Sends a number; with ``final`` False while it moves."""

    name: str
    text: str
    value: float
    low: float
    high: float
    whole: bool = False


@dataclass(frozen=True)
class Number:
    """Sends a number typed in."""

    name: str
    text: str
    value: float
    low: float = -1e9
    high: float = 1e9
    whole: bool = False


@dataclass(frozen=True)
class Entry:
    """Sends a text typed in."""

    name: str
    text: str
    value: str


@dataclass(frozen=True)
class Items:
    """A list; sends the index of the item that was clicked. ``chosen`` is -1 for none, ``empty`` what to say then."""

    name: str
    items: tuple[str, ...]
    chosen: int = -1
    rows: int = 8
    empty: str = ""


Row = Heading | Note | Button | Buttons | Check | Choice | Slider | Number | Entry | Items
