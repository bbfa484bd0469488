"""History: what was done, in words; switch it off, undo it, delete it, go to its frame, open it again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.editing import EditSession
from toolkit.editing.words import describe
from toolkit.errors import InputError
from toolkit.pose_edit import BeyondConstraint, DistanceConstraint, FixedConstraint, PointConstraint, Residual
from toolkit.progress import Progress
from toolkit.rendering.camera import triple
from toolkit.shot.journal import Edit
from viewer.modes.base import Mode, Tint
from viewer.modes.detail.draft import DetailDraft
from viewer.modes.pose.draft import PoseDraft
from viewer.modes.shared.open_edit import OpenEdit
from viewer.modes.shared.pointing import pointed_at, shows_result
from viewer.state.events import Key, Pointer
from viewer.state.marks import BLUE, GREY, YELLOW, Curve, Disc, Mark
from viewer.state.rows import Button, Buttons, Heading, Items, Note, Row

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["History"]

_ROWS = 12
_REGION = np.array([1.0, 0.62, 0.10], np.float32)
_HELD = np.array([0.20, 0.45, 0.95], np.float32)
_GRIP = 12.0
_MOST_RESIDUALS = 14


@dataclass(frozen=True, eq=False)
class Sketch:
    """What of an edit can be drawn.

    ``frames`` that it is about, ``vertices`` to mark it by, a ``region`` (n,) with ``weights`` (n,): where details
    change, or what is held still.
    """

    frames: tuple[int, ...] = ()
    vertices: tuple[int, ...] = ()
    region: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    weights: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))


class History(Mode):
    """The journal's edits, in the order in which they act."""

    name = "history"
    title = "History"
    pairs = ("before_after", "performance", "map")

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self.number: int | None = None
        self.residuals: tuple[int, tuple[Residual, ...]] | None = None
        self._asked: object = None
        self._sketches: dict[int, tuple[Edit, Sketch]] = {}

    # -- what is shown --------------------------------------------------------------------------------------------

    def hint(self) -> str:
        """What a click does."""
        return "choose an edit in the list, or click its mark; x switches it on or off, enter opens it again"

    def rows(self) -> Sequence[Row]:
        """The list, what can be done with the chosen edit, and how well its points are met."""
        editing = self.app.editing
        if editing.snapshot is None:
            words = "opening the shot for edits ..." if editing.opening else editing.problem or "no edits yet"
            return [Note(words, "quiet")]
        shown, edits = editing.snapshot, editing.edits
        chosen = self.chosen
        rows: list[Row] = [
            Items(
                "edit",
                tuple(line(edit) for edit in edits),
                edits.index(chosen) if chosen in edits else -1,
                _ROWS,
                "no edits yet",
            ),
            Buttons(
                (
                    Button("undo", "Undo (z)", shown.can_undo is not None),
                    Button("redo", "Redo (Z)", shown.can_redo is not None),
                )
            ),
        ]
        steps = [f"undo: {shown.can_undo}"] if shown.can_undo else []
        steps += [f"redo: {shown.can_redo}"] if shown.can_redo else []
        if steps:
            rows.append(Note("\n".join(steps), "quiet"))
        if chosen is None:
            rows.append(Note("Edits appear here once they are committed." if not edits else "Choose an edit.", "quiet"))
            return rows
        return rows + self._chosen_rows(chosen, shown.problems.get(chosen.number))

    def _chosen_rows(self, chosen: Edit, problem: str | None) -> list[Row]:
        rows: list[Row] = [Heading(f"Edit {chosen.number}"), Note(describe(chosen))]
        if problem:
            rows.append(Note(f"It cannot be applied: {problem}", "bad"))
        rows.append(
            Buttons(
                (
                    Button("switch", "Switch off (x)" if chosen.on else "Switch on (x)"),
                    Button("open", "Change"),
                    Button("remove", "Delete"),
                    Button("go", "Go to its frame"),
                )
            )
        )
        if chosen.kind == "pose" and chosen.on and not problem:
            self._ask_residuals(chosen.number)
            if self.residuals is not None and self.residuals[0] == chosen.number:
                found = self.residuals[1]
                rows.append(Note("How well it is met, in the target's unit:", "quiet"))
                rows += [Note(told(one), _tone(one)) for one in found[:_MOST_RESIDUALS]]
                if len(found) > _MOST_RESIDUALS:
                    rows.append(Note(f"and {len(found) - _MOST_RESIDUALS} more", "quiet"))
        return rows

    def marks(self, pane: int) -> Sequence[Mark]:
        """Where edits of this frame take hold; the chosen one in yellow."""
        if not shows_result(self.app, pane):
            return ()
        vertices = self.app.surface(pane).vertices
        marks: list[Mark] = []
        for edit, ids in self._taking_hold():
            color = YELLOW if edit.number == self.number else (BLUE if edit.on else GREY)
            places = [triple(vertices[vertex]) for vertex in ids]
            if len(places) == 2 and edit.number == self.number:
                marks.append(Curve(np.array(places), color, 1.6))
            marks += [Disc(place, color, 5.0, str(edit.number)) for place in places]
        return marks

    def tint(self, pane: int) -> Tint | None:
        """The chosen edit's region, or what it holds still."""
        chosen = self.chosen
        if chosen is None or not shows_result(self.app, pane):
            return None
        share = np.zeros(len(self.app.surface(pane).vertices), np.float32)
        known = self._sketch(chosen)
        inside = known.region < len(share)
        share[known.region[inside]] = 0.4 * known.weights[inside]
        return (_REGION if chosen.kind == "detail" else _HELD), share

    def key_frames(self) -> Sequence[int]:
        """The frames of the chosen edit."""
        return self._sketch(self.chosen).frames if self.chosen is not None else ()

    def keys(self) -> Sequence[tuple[str, str]]:
        """For the help."""
        return (
            ("up, down", "the edit before or after"),
            ("x", "switch the chosen edit on or off"),
            ("delete", "delete the chosen edit"),
            ("enter", "open it again to change it"),
        )

    @property
    def chosen(self) -> Edit | None:
        """The chosen edit, if it is still there."""
        return next((edit for edit in self.app.editing.edits if edit.number == self.number), None)

    # -- what is done ---------------------------------------------------------------------------------------------

    def enter(self) -> None:
        """The last edit is chosen; drafts of other modes step back."""
        edits = self.app.editing.edits
        if self.chosen is None and edits:
            self.number = edits[-1].number
        shown = self.app.editing.snapshot
        if shown is not None and shown.has_draft:
            self.app.editing.drop_draft()

    def panel(self, name: str, value: Any, final: bool) -> None:
        """A row was used."""
        if name == "edit":
            edits = self.app.editing.edits
            if 0 <= int(value) < len(edits):
                self.choose(edits[int(value)])
        elif name in ("switch", "remove", "open", "go"):
            {"switch": self.switch, "remove": self.remove, "open": self.open, "go": self.go}[name]()

    def key(self, event: Key) -> bool:
        """Up and down, x, delete, enter."""
        actions = {"x": self.switch, "delete": self.remove, "backspace": self.remove, "enter": self.open}
        if event.name in ("up", "down"):
            self._step(-1 if event.name == "up" else 1)
        elif event.name in actions:
            actions[event.name]()
        else:
            return False
        self.app.touch("panel", "overlay", "faces")
        return True

    def click(self, event: Pointer) -> None:
        """A mark chooses its edit."""
        if not shows_result(self.app, event.pane):
            return
        vertices = self.app.surface(event.pane).vertices
        held = [(edit, vertex) for edit, ids in self._taking_hold() for vertex in ids]
        index = pointed_at(self.app, event, [vertices[vertex] for _, vertex in held], _GRIP)
        if index >= 0:
            self.choose(held[index][0], go=False)

    def choose(self, edit: Edit, go: bool = True) -> None:
        """Show an edit and its frame."""
        self.number = edit.number
        if go:
            self.go()
        self.app.touch("panel", "overlay", "faces", "timeline")

    def go(self) -> None:
        """To the first frame of the chosen edit."""
        frames = self._sketch(self.chosen).frames if self.chosen is not None else ()
        if frames and self.app.play.frame not in frames:
            self.app.go_to_frame(frames[0])

    def switch(self) -> None:
        """The chosen edit off, or on again."""
        edit = self._need()
        words = f"edit {edit.number} is switched {'off' if edit.on else 'on'}"
        self._call(words, lambda session, _: session.switch(edit.number, not edit.on))

    def remove(self) -> None:
        """Delete the chosen edit; undo brings it back."""
        edit = self._need()
        numbers = [other.number for other in self.app.editing.edits]
        at = numbers.index(edit.number)
        left = numbers[:at] + numbers[at + 1 :]
        self._call(
            f"edit {edit.number} is deleted; undo brings it back", lambda session, _: session.remove(edit.number)
        )
        self.number = left[min(at, len(left) - 1)] if left else None

    def open(self) -> None:
        """Open the chosen edit in its own mode, to change it."""
        edit = self._need()
        mode = next((m for m in self.app.modes.values() if isinstance(m, OpenEdit) and m.kind == edit.kind), None)
        if mode is None:
            raise InputError(f'edits of the kind "{edit.kind}" cannot be opened here')
        shown = self.app.editing.snapshot
        if shown is not None and edit.number in shown.problems:
            raise InputError(f"edit {edit.number} cannot be applied, so there is nothing to change", remedy="delete it")
        if not edit.on:
            raise InputError(f"edit {edit.number} is switched off", remedy="switch it on first")
        mode.open(edit)
        self.app.choose_mode(mode.name)

    # -- inside ---------------------------------------------------------------------------------------------------

    def _call(self, words: str, work: Any) -> None:
        self.app.editing.call("following the journal", work, lambda _: self.app.say(words))

    def _need(self) -> Edit:
        if self.chosen is None:
            raise InputError("no edit is chosen", remedy="choose one in the list")
        return self.chosen

    def _step(self, count: int) -> None:
        edits = self.app.editing.edits
        if edits:
            at = edits.index(self.chosen) if self.chosen in edits else -1
            self.choose(edits[min(max(at + count, 0), len(edits) - 1)])

    def _taking_hold(self) -> list[tuple[Edit, tuple[int, ...]]]:
        """Edits of this frame and the vertices to mark each by."""
        sketches = [(edit, self._sketch(edit)) for edit in self.app.editing.edits]
        return [(edit, sketch.vertices) for edit, sketch in sketches if self.app.play.frame in sketch.frames]

    def _sketch(self, edit: Edit) -> Sketch:
        """Read from its data once: marks are drawn at every turn of the view."""
        known = self._sketches.get(edit.number)
        if known is None or known[0] is not edit:
            known = self._sketches[edit.number] = (edit, sketch_of(edit, self.app.data.registered))
        return known[1]

    def _ask_residuals(self, number: int) -> None:
        """In the worker: the session may be busy."""
        session, shown = self.app.editing.session, self.app.editing.snapshot
        key = (number, id(shown))
        if session is None or self._asked == key:
            return
        self._asked = key

        def work(progress: Progress, session: EditSession = session) -> tuple[Residual, ...]:
            return session.residuals(number)

        def done(found: tuple[Residual, ...]) -> None:
            self.residuals = (number, found)
            self.app.touch("panel")

        self.app.run_task("residuals", work, done, slot="residuals", quiet=True, failed=lambda error: None)


def line(edit: Edit) -> str:
    """An edit in one line of the list."""
    return f"{edit.number}  {'' if edit.on else '(off) '}{describe(edit)}"


def told(residual: Residual) -> str:
    """How well a constraint is met, in words."""
    one = residual.constraint
    if isinstance(one, PointConstraint):
        return f"frame {one.frame}, vertex {one.vertex}: asked {residual.asked:.3g}, {residual.left:.3g} left"
    if isinstance(one, DistanceConstraint):
        ends = f"{one.vertices[0]} to {one.vertices[1]}"
        return f"frame {one.frame}, {ends}: asked {residual.asked:.3g}, {residual.left:.3g} left"
    if isinstance(one, FixedConstraint):
        return f"{len(one.vertices)} vertices held: they move by {residual.left:.3g}"
    assert isinstance(one, BeyondConstraint)
    return f"all beyond {one.distance:.3g} held: it moves by {residual.left:.3g}"


def sketch_of(edit: Edit, rest: NDArray[np.floating]) -> Sketch:
    """What of an edit can be drawn, on a face ``rest`` (V, 3); nothing of one that cannot be read."""
    try:
        if edit.kind == "pose":
            pose = PoseDraft.from_data(edit.data)
            ends = [(h.vertex,) if isinstance(h, PointConstraint) else h.vertices for h in pose.handles]
            if max(pose.highest[1:]) >= len(rest):
                return Sketch()
            held = np.array(pose.fixed, dtype=np.int64)
            return Sketch(tuple(pose.frames), tuple(int(v) for end in ends for v in end), held, np.ones(len(held)))
        detail = DetailDraft.from_data(edit.data)
    except InputError:
        return Sketch()
    region = detail.region
    if region is None or not len(region) or region.vertices[-1] >= len(rest):
        return Sketch(tuple(detail.frames))
    places = rest[region.vertices]
    middle = int(region.vertices[np.argmin(np.linalg.norm(places - places.mean(axis=0), axis=1))])
    return Sketch(tuple(detail.frames), (middle,), region.vertices, region.weights)


def _tone(residual: Residual) -> str:
    return "bad" if residual.asked > 0 and residual.left > 0.2 * residual.asked else "plain"
