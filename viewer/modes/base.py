"""The interface of a mode. A mode is a plain object: it is given events, and says what to show.

It never draws: it returns rows for the panel, marks for a pane, words for the status line, and tells the application
what changed (`App.touch`). Long work goes through ``app.worker``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from viewer.state.events import Key, Pointer
from viewer.state.marks import Mark
from viewer.state.rows import Row

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["Mode", "Tint"]

Tint = tuple[NDArray[np.float32], NDArray[np.float32]]
"""Colours ``(V, 3)`` or ``(3,)`` to lay over a surface, and how much of them, ``(V,)`` in 0..1."""


class Mode:
    """A mode that does nothing; modes override what they need.

    ``name`` for scripts, ``title`` for the user, ``pairs`` the pane pairs that it works on, the first of which it turns
    to when it is entered and another is shown. ``hits_in_drag`` asks for what the ray hits also in drags that it keeps,
    ``hovers`` for events while no button is down.
    """

    name = ""
    title = ""
    pairs: tuple[str, ...] = ()
    hits_in_drag = False
    hovers = False

    def __init__(self, app: App) -> None:
        self.app = app

    def enter(self) -> None:
        """The mode was chosen."""

    def leave(self) -> None:
        """Another mode was chosen; finish or keep what is open, nothing may be lost."""

    def refresh(self) -> None:
        """The shot changed on disk, or the edit session was opened: read again what is kept of it."""

    def hint(self) -> str:
        """What a click will do now, for the status line."""
        return "drag to turn, right button pans, wheel zooms"

    def rows(self) -> Sequence[Row]:
        """The panel's rows."""
        return ()

    def marks(self, pane: int) -> Sequence[Mark]:
        """What is drawn on top of a pane's face."""
        return ()

    def tint(self, pane: int) -> Tint | None:
        """Colours to lay over a pane's face."""
        return None

    def press(self, event: Pointer) -> bool:
        """The left button went down; True keeps the drag that follows from turning the view."""
        return False

    def drag(self, event: Pointer) -> None:
        """The pointer moved in a drag that `press` kept."""

    def release(self, event: Pointer) -> None:
        """The button went up after a drag that `press` kept."""

    def click(self, event: Pointer) -> None:
        """The left button went down and up on one place, and `press` had not kept it."""

    def hover(self, event: Pointer) -> None:
        """The pointer moves with no button down."""

    def wheel(self, event: Pointer) -> bool:
        """The wheel was turned; True keeps it from zooming."""
        return False

    def key(self, event: Key) -> bool:
        """A key that the application does not know; True if it was used."""
        return False

    def panel(self, name: str, value: Any, final: bool) -> None:
        """A row of the panel was used."""

    def frame_changed(self) -> None:
        """Another frame is shown."""

    def key_frames(self) -> Sequence[int]:
        """Frames to mark on the time line with a diamond."""
        return ()

    def gain_curve(self) -> NDArray[np.float64] | None:
        """How strong the open edit is over the take, ``(T,)``, where it says so."""
        return None

    def undo(self) -> bool:
        """Take back the last thing that only this mode knows of; False leaves it to the journal."""
        return False

    def redo(self) -> bool:
        """Do again what `undo` took back; False leaves it to the journal."""
        return False

    def keys(self) -> Sequence[tuple[str, str]]:
        """Keys of this mode and what they do, for the help."""
        return ()
