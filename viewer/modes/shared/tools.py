"""An edit that is made with tools, one of them a brush: what the modes for such edits have in common."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from toolkit.errors import InputError
from viewer.modes.base import Tint
from viewer.modes.shared.brush import LARGEST, SMALLEST, Brush
from viewer.modes.shared.ground import Grounds
from viewer.modes.shared.open_edit import D, OpenEdit
from viewer.modes.shared.pointing import shows_result
from viewer.state.events import Hit, Key, Pointer
from viewer.state.marks import Mark
from viewer.state.rows import Button, Buttons, Check, Note, Row, Slider

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["ToolEdit"]


class ToolEdit(OpenEdit[D]):
    """``tools`` are (name, words), ``tool_keys`` their keys; ``brush_tool`` paints, ``hovering`` ones want to hover."""

    tools: ClassVar[Sequence[tuple[str, str]]] = ()
    tool_keys: ClassVar[Mapping[str, str]] = {}
    brush_tool = ""
    hovering: ClassVar[frozenset[str]] = frozenset()

    def __init__(self, app: App, grounds: Grounds) -> None:
        super().__init__(app, grounds)
        self.tool = self.tools[0][0]
        self.brush = Brush()
        self.under: tuple[int, Hit] | None = None
        self.settings = False

    @abstractmethod
    def tool_hint(self) -> str:
        """What a click will do now."""

    @abstractmethod
    def edit_rows(self) -> Sequence[Row]:
        """The panel's rows when the shot is open for edits."""

    @abstractmethod
    def edit_marks(self, pane: int) -> Sequence[Mark]:
        """What is drawn on the face that is edited."""

    @abstractmethod
    def edit_tint(self, pane: int) -> Tint | None:
        """Colours to lay over the face that is edited."""

    @abstractmethod
    def edit_key(self, event: Key) -> bool:
        """A key that is neither a tool's nor of all edits; True if it was used."""

    @abstractmethod
    def row_used(self, name: str, value: Any, final: bool) -> None:
        """A row that not all edits have was used."""

    @abstractmethod
    def window_moved(self, window: tuple[int, int] | None, final: bool) -> None:
        """The window on the time line is another."""

    @abstractmethod
    def give_up_gesture(self) -> bool:
        """Escape, while a gesture goes on; False if there is none."""

    def usable(self, tool: str) -> str:
        """The tool that is taken when one is asked for."""
        return tool

    # -- what is shown --------------------------------------------------------------------------------------------

    def enter(self) -> None:
        """The tool is as it was."""
        self.choose_tool(self.tool)
        super().enter()

    def hint(self) -> str:
        """By tool."""
        return self.tool_hint() if self.app.editing.session is not None else "the shot has to be open for edits"

    def rows(self) -> Sequence[Row]:
        """The edit's own, or why there are none."""
        editing = self.app.editing
        if editing.session is not None:
            return self.edit_rows()
        if editing.problem:
            return [Note(editing.problem, "bad")]
        words = "opening the shot for edits ..." if editing.opening else "Run all steps first; then edits can be made."
        return [Note(words, "quiet")]

    def marks(self, pane: int) -> Sequence[Mark]:
        """On the face that is edited."""
        return self.edit_marks(pane) if shows_result(self.app, pane) else ()

    def tint(self, pane: int) -> Tint | None:
        """On the face that is edited."""
        return self.edit_tint(pane) if shows_result(self.app, pane) else None

    def tool_row(self) -> Row:
        """The tools that can be used now."""
        usable = [(name, words) for name, words in self.tools if self.usable(name) == name]
        return Buttons(tuple(Button(f"tool:{name}", words, on=name == self.tool) for name, words in usable))

    def commit_rows(self) -> list[Row]:
        """Commit or give up, and what it changes."""
        draft = self.draft
        possible = draft is not None and not self.committing
        commit = Button("commit", "Commit (Enter)", possible and draft is not None and not draft.empty)
        rows: list[Row] = [Buttons((commit, Button("drop", "Cancel (Esc)", possible)))]
        if draft is not None and draft.instead_of is not None:
            rows.append(Note(f"changes edit {draft.instead_of}", "quiet"))
        return rows

    def brush_row(self) -> Row:
        """The brush's size."""
        return Slider("brush", "brush, % of the face", 100 * self.brush.radius, 100 * SMALLEST, 100 * LARGEST)

    def settings_row(self) -> Row:
        """Shows what is seldom needed."""
        return Check("settings", "more settings", self.settings)

    # -- what is done ---------------------------------------------------------------------------------------------

    def hover(self, event: Pointer) -> None:
        """The brush's ring follows."""
        seen = event.hit is not None and shows_result(self.app, event.pane)
        self.under = (event.pane, event.hit) if seen and event.hit is not None else None
        self.app.touch("overlay")

    def wheel(self, event: Pointer) -> bool:
        """With ctrl: the brush's size."""
        if self.tool != self.brush_tool or "ctrl" not in event.modifiers:
            return False
        self.brush.turned(event.wheel)
        self.app.touch("overlay", "panel")
        return True

    def key(self, event: Key) -> bool:
        """Tools, brush, commit, cancel, and the mode's own."""
        if event.name in self.tool_keys:
            self.choose_tool(self.tool_keys[event.name])
        elif event.name == "enter":
            self.commit()
        elif event.name in ("[", "]"):
            self.brush.turned(-1 if event.name == "[" else 1)
        elif not (self._escape() if event.name == "escape" else self.edit_key(event)):
            return False
        self.app.touch("panel", "overlay", "status")
        return True

    def _escape(self) -> bool:
        if self.app.worker.progress is not None:
            return False  # that is cancelled first
        if not self.give_up_gesture():
            if self.draft is None:
                return False
            self.cancel()
        self.app.touch("faces")
        return True

    def panel(self, name: str, value: Any, final: bool) -> None:
        """A row was used, or the window on the time line."""
        if name == "window":
            if self.draft is not None:
                self.window_moved(value, final)
        elif name.startswith("tool:"):
            self.choose_tool(name[5:])
        elif name == "commit":
            self.commit()
        elif name == "drop":
            self.cancel()
        elif name == "brush":
            self.brush.radius = float(np.clip(float(value) / 100, SMALLEST, LARGEST))
        elif name == "settings":
            self.settings = bool(value)
        else:
            self.row_used(name, value, final)

    def choose_tool(self, tool: str) -> None:
        """Another tool."""
        known = dict(self.tools)
        if tool not in known:
            raise InputError(f"there is no tool {tool!r}", remedy=f"tools are {', '.join(known)}")
        self.tool, self.under = self.usable(tool), None
        self.hovers = self.tool in self.hovering
        self.app.touch("overlay", "panel", "status")
