"""Feature lines: picked vertices joined along edges; round eyes and mouth they hold the transfer together.

A line lives on the source's topology; the same line on the target's own mesh may be drawn too, for the registration.
Every finished line is written to feature_lines.json at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.feature_lines import EdgePaths, FeatureLine, load_feature_lines, save_feature_lines
from toolkit.progress import Progress
from toolkit.rendering.camera import triple
from viewer.modes.base import Mode
from viewer.modes.undo import UndoStack
from viewer.state.events import Key, Pointer
from viewer.state.marks import GREEN, ORANGE, YELLOW, Curve, Disc, Mark
from viewer.state.rows import Button, Buttons, Check, Entry, Items, Note, Row

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["FeatureLineMode"]

Ids = NDArray[np.int64]
_PathKey = tuple[str, tuple[int, ...], bool]
_State = tuple[tuple[FeatureLine, ...], tuple[int, ...], str]


class FeatureLineMode(Mode):
    """Pick vertices; they are joined along the shortest path of edges."""

    name = "feature_lines"
    title = "Lines"
    pairs = ("references", "take", "performance", "registration")

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._lines: tuple[FeatureLine, ...] = ()
        self._picks: tuple[int, ...] = ()
        self._side = "source"
        self._path: dict[_PathKey, Ids] = {}
        self._tracing: tuple[FeatureLine, ...] | None = None
        self._undo: UndoStack[_State] = UndoStack()
        self.chosen = -1
        self._name = ""
        self.refresh()

    # -- what is shown --------------------------------------------------------------------------------------------

    def hint(self) -> str:
        """What a click does."""
        if self._picks:
            return f"{len(self._picks)} picked on the {self._side}: click the next, Enter ends the line, C closes it"
        if 0 <= self.chosen < len(self._lines):
            name = self._lines[self.chosen].name
            return f'click on the source to begin a new line, on the target to draw "{name}" there'
        return "click a vertex on the source to begin a line"

    def rows(self) -> Sequence[Row]:
        """The list, the name, and what can be done."""
        words = tuple(_in_words(line) for line in self._lines)
        drawing = bool(self._picks)
        known = 0 <= self.chosen < len(self._lines)
        name = self._name if drawing or not known else self._lines[self.chosen].name
        rows: list[Row] = [
            Items("line", words, self.chosen, 10, "no lines yet"),
            Entry("line name", "name", name),
            Buttons(
                (
                    Button("line end", "End", len(self._picks) > 1),
                    Button("line close", "Close", len(self._picks) > 2),
                    Button("line back", "Back", drawing),
                    Button("line drop", "Drop", drawing),
                )
            ),
            Buttons(
                (
                    Button("line delete", "Delete", known and not drawing),
                    Button("undo", "Undo", self._undo.can_undo),
                    Button("redo", "Redo", self._undo.can_redo),
                    Button("line save", "Save"),
                )
            ),
        ]
        if known and not drawing:
            rows.append(Check("line closed", "closed", self._lines[self.chosen].closed))
            rows.append(Check("line guide", "a guide: for the registration only", self._lines[self.chosen].guide))
        rows.append(Note("lid, lip, mouth or eye in the name: the rim of an opening (not with outer)", "quiet"))
        return rows

    def marks(self, pane: int) -> Sequence[Mark]:
        """Every line, the chosen one in yellow, and the one being drawn."""
        surface = self.app.surface(pane)
        vertices, side = surface.vertices, surface.mesh
        found: list[Mark] = []
        for index, line in enumerate(self._lines):
            ids = line.vertices if side == "source" else line.target_vertices
            if ids is None or len(ids) < 2 or ids.max() >= len(vertices):
                continue
            path = self._path.get((side, tuple(ids.tolist()), line.closed))
            if path is None:
                self._trace_all()
                path = ids
            chosen = index == self.chosen and not self._picks
            found.append(Curve(vertices[path], YELLOW if chosen else GREEN, 3.0 if chosen else 2.2, line.closed))
        if self._picks and self._side == side:
            if len(self._picks) > 1:
                found.append(Curve(vertices[self._traced(side, self._picks, False)], ORANGE, 3.0))
            found += [Disc(triple(vertices[v]), ORANGE, 5.0, str(n)) for n, v in enumerate(self._picks, start=1)]
        return found

    def keys(self) -> Sequence[tuple[str, str]]:
        """Keys while drawing."""
        return (
            ("enter", "end the line"),
            ("c", "close the line"),
            ("backspace", "take back the last vertex"),
            ("delete", "delete the chosen line"),
        )

    # -- gestures -------------------------------------------------------------------------------------------------

    def click(self, event: Pointer) -> None:
        """The next vertex of the line."""
        if event.hit is None:
            return
        side = self.app.surface(event.pane).mesh
        if not self._picks:
            if side == "target" and not 0 <= self.chosen < len(self._lines):
                self.app.say("choose the line in the list first; on the target its counterpart is drawn", "bad")
                return
            self._side = side
        elif side != self._side:
            self.app.say(f"this line is on the {self._side}: end it first", "bad")
            return
        elif self._picks[-1] == event.hit.vertex:
            return
        elif self._picks[0] == event.hit.vertex and len(self._picks) > 2:
            self._finish(True)
            return
        picks = (*self._picks, event.hit.vertex)
        self._traced(side, picks, False)  # refuses a vertex that no edges lead to
        self._remember()
        self._picks = picks
        self.app.touch("overlay", "panel", "status")

    def key(self, event: Key) -> bool:
        """End, close, take back, delete."""
        if event.name == "enter" and len(self._picks) > 1:
            self._finish(False)
        elif event.name == "c" and len(self._picks) > 2:
            self._finish(True)
        elif event.name == "backspace" and self._picks:
            self._back()
        elif event.name == "escape" and self._picks:
            self._drop()
        elif event.name == "delete":
            self._delete()
        else:
            return False
        return True

    def panel(self, name: str, value: Any, final: bool) -> None:
        """The list, the name and the buttons."""
        if name == "line":
            self.chosen = int(value) if 0 <= int(value) < len(self._lines) else -1
        elif name == "line name":
            self._rename(str(value).strip())
        elif name == "line end" and len(self._picks) > 1:
            self._finish(False)
        elif name == "line close" and len(self._picks) > 2:
            self._finish(True)
        elif name == "line back" and self._picks:
            self._back()
        elif name == "line drop":
            self._drop()
        elif name == "line delete":
            self._delete()
        elif name == "line closed" and 0 <= self.chosen < len(self._lines):
            self._set(_with(self._lines, self.chosen, replace(self._lines[self.chosen], closed=bool(value))))
        elif name == "line guide" and 0 <= self.chosen < len(self._lines):
            self._set(_with(self._lines, self.chosen, replace(self._lines[self.chosen], guide=bool(value))))
        elif name == "line save":
            words = f"{len(self._lines)} lines are in {self.app.shot.feature_lines_path}"
            self._save(lambda: self.app.say(words, "good"))

    def leave(self) -> None:
        """A line that was begun is kept, as an open one."""
        if len(self._picks) > 1:
            self._finish(False)
        self._picks = ()

    def undo(self) -> bool:
        """Take back the last vertex, line or change."""
        return self._restore(self._undo.undo(self._state))

    def redo(self) -> bool:
        """Do it again."""
        return self._restore(self._undo.redo(self._state))

    def refresh(self) -> None:
        """Read feature_lines.json."""
        self._path, self._tracing = {}, None
        path = self.app.shot.feature_lines_path
        if path.exists():
            lines = tuple(load_feature_lines(path))
            if [_key(line) for line in lines] != [_key(line) for line in self._lines]:
                self._lines, self._undo, self.chosen = lines, UndoStack(), -1

    # -- inside ---------------------------------------------------------------------------------------------------

    @property
    def _state(self) -> _State:
        return self._lines, self._picks, self._side

    def _remember(self) -> None:
        self._undo.push(self._state)

    def _restore(self, state: _State | None) -> bool:
        if state is None:
            return False
        changed = [_key(line) for line in state[0]] != [_key(line) for line in self._lines]
        self._lines, self._picks, self._side = state
        self.chosen = min(self.chosen, len(self._lines) - 1)
        if changed:
            self._save()
        self.app.touch("overlay", "panel", "status")
        return True

    def _traced(self, side: str, picks: tuple[int, ...], closed: bool) -> Ids:
        """The path of edges through some vertices; found once, from what is known of the vertices before the last."""
        key = (side, picks, closed)
        if key not in self._path:
            begun = self._path.get((side, picks if closed else picks[:-1], False))
            paths = self.app.nets.paths(side)
            if begun is None or len(begun) < 2:
                self._path[key] = _path_through(paths, picks, closed)
            elif closed:
                self._path[key] = np.concatenate([begun, paths.through((picks[-1], picks[0]), False)[1:-1]])
            else:
                self._path[key] = np.concatenate([begun, paths.through(picks[-2:], False)[1:]])
        return self._path[key]

    def _trace_all(self) -> None:
        """Find the paths of all lines in the worker; their vertices are joined straight until then."""
        wanted = [("source", line.vertices, line.closed) for line in self._lines]
        wanted += [("target", ids, line.closed) for line in self._lines if (ids := line.target_vertices) is not None]
        nets, known = self.app.nets, self._path
        if self._tracing is self._lines or not all(nets.ready(side) for side, _, _ in wanted):
            return
        self._tracing = self._lines

        def done(found: dict[_PathKey, Ids]) -> None:
            if self._path is known:
                known.update(found)
                self.app.touch("overlay")

        def work(progress: Progress) -> dict[_PathKey, Ids]:
            keys = [(side, tuple(ids.tolist()), closed) for side, ids, closed in wanted]
            return {key: _path_through(nets.paths(key[0]), key[1], key[2]) for key in keys if key not in known}

        self.app.run_task("following the lines", work, done, slot="lines", quiet=True)

    def _finish(self, closed: bool) -> None:
        path = self._traced(self._side, self._picks, closed)
        self._remember()
        if self._side == "target":
            line = replace(self._lines[self.chosen], target_vertices=path)
            self._lines = _with(self._lines, self.chosen, line)
        else:
            taken = {line.name for line in self._lines}
            number = next(n for n in range(len(self._lines) + 1, 10**6) if f"line {n}" not in taken)
            self._lines = (*self._lines, FeatureLine(self._name or f"line {number}", closed, path))
            self.chosen = len(self._lines) - 1
        self._picks, self._name = (), ""
        self._save()

    def _back(self) -> None:
        self._remember()
        self._picks = self._picks[:-1]
        self.app.touch("overlay", "panel", "status")

    def _drop(self) -> None:
        if self._picks:
            self._remember()
            self._picks = ()
            self.app.touch("overlay", "panel", "status")

    def _delete(self) -> None:
        if 0 <= self.chosen < len(self._lines):
            self._set(self._lines[: self.chosen] + self._lines[self.chosen + 1 :])
            self.chosen = min(self.chosen, len(self._lines) - 1)

    def _rename(self, name: str) -> None:
        if self._picks or not 0 <= self.chosen < len(self._lines):
            self._name = name
        elif name and name != self._lines[self.chosen].name:
            self._set(_with(self._lines, self.chosen, replace(self._lines[self.chosen], name=name)))

    def _set(self, lines: tuple[FeatureLine, ...]) -> None:
        self._remember()
        self._lines = lines
        self._save()

    def _save(self, done: Callable[[], None] = lambda: None) -> None:
        path, lines = self.app.shot.feature_lines_path, self._lines
        self.app.saver.save(path, lambda: save_feature_lines(path, lines), done)
        self.app.touch("overlay", "panel", "status")
        self.app.check_steps()


def _with(lines: tuple[FeatureLine, ...], index: int, line: FeatureLine) -> tuple[FeatureLine, ...]:
    return (*lines[:index], line, *lines[index + 1 :])


def _path_through(paths: EdgePaths, picks: tuple[int, ...], closed: bool) -> Ids:
    ids = np.array(picks, dtype=np.int64)
    return ids if len(picks) < 2 or paths.joins(ids, closed) else paths.through(picks, closed)


def _key(line: FeatureLine) -> tuple[Any, ...]:
    target = None if line.target_vertices is None else tuple(line.target_vertices.tolist())
    return line.name, line.closed, line.guide, tuple(line.vertices.tolist()), target


def _in_words(line: FeatureLine) -> str:
    shape = ("closed" if line.closed else "open") + (", a guide" if line.guide else "")
    target = "" if line.target_vertices is None else ", on the target too"
    return f"{line.name}   {len(line.vertices)} vertices, {shape}{target}"
