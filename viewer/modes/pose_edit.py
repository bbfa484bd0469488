"""Pose edit: pull points of a frame, set distances, hold parts of the face, and watch the performance follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit import Region, painted
from toolkit.editing import EditSession
from toolkit.errors import InputError
from toolkit.pose_edit import DistanceConstraint, PointConstraint, Residual
from toolkit.progress import Progress
from toolkit.shot.journal import Edit
from viewer.modes.base import Tint
from viewer.modes.pose.beyond import Beyond
from viewer.modes.pose.draft import PoseDraft, goal_of
from viewer.modes.pose.marks import pose_marks, pose_tint
from viewer.modes.pose.panel import KEYS, hint, pose_rows, used
from viewer.modes.shared.brush import Brush
from viewer.modes.shared.ground import Grounds
from viewer.modes.shared.open_edit import OpenEdit
from viewer.modes.shared.pointing import on_plane, pointed_at, shows_result
from viewer.picking import Picker
from viewer.state.events import Hit, Key, Pointer
from viewer.state.marks import Mark
from viewer.state.rows import Row

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["TOOLS", "PoseEdit"]

Array = NDArray[np.float64]
_Frames = dict[int, NDArray[np.float32]]

TOOLS = (("move", "Move"), ("distance", "Distance"), ("fix", "Hold"))
_GRIP = 11.0  # pixels round a handle that take hold of it
_MOST_FRAMES = 4


@dataclass(frozen=True)
class _Grab:
    """A point under the pointer: the plane that it moves in, and where it was; ``index`` -1 is one to be made."""

    index: int
    vertex: int
    goal: Array
    anchor: Array
    normal: Array
    before: PoseDraft | None


class PoseEdit(OpenEdit[PoseDraft]):
    """An open edit is a `PoseDraft`; each gesture makes a new one, and the worker solves the newest."""

    name = kind = "pose"
    title = "Pose edit"

    def __init__(self, app: App, grounds: Grounds) -> None:
        super().__init__(app, grounds)
        self.tool = "move"
        self.selected = -1
        self.pending: int | None = None
        self.brush = Brush()
        self.under: tuple[int, Hit] | None = None
        self.residuals: tuple[Residual, ...] = ()
        self.settings = False
        self.beyond = Beyond(app)
        self._solved: PoseDraft | None = None
        self._base: Any = None
        self._frames: _Frames = {}
        self._grab: _Grab | None = None
        self._stroke: tuple[Pointer | None, PoseDraft | None, Picker] | None = None

    # -- life -----------------------------------------------------------------------------------------------------

    def draft_from(self, data: Mapping[str, Any], number: int | None = None) -> PoseDraft:
        """Of the journal or of the file of drafts."""
        return PoseDraft.from_data(data, number)

    def enter(self) -> None:
        """The tool is as it was."""
        self._choose_tool(self.tool)
        super().enter()

    def leave(self) -> None:
        """The open edit is on disk already; only a drag that was not let go is given up."""
        if self._grab is not None:
            self.draft = self._grab.before
        self._grab = self._stroke = self.under = None
        self.pending = None

    def forget(self) -> None:
        """Where the face is without the edit, and what the solver left."""
        self.residuals, self._solved, self._base = (), None, None
        self._frames.clear()

    def refresh(self) -> None:
        """Another session may have another face."""
        self.beyond.forget()
        super().refresh()

    def open(self, edit: Edit) -> None:
        """The first handle is chosen."""
        super().open(edit)
        self.selected = 0 if self.draft is not None and self.draft.handles else -1

    # -- what is shown --------------------------------------------------------------------------------------------

    def hint(self) -> str:
        """By tool."""
        return hint(self)

    def rows(self) -> Sequence[Row]:
        """Tools, handles, what is held, how it spreads, commit."""
        return pose_rows(self)

    def marks(self, pane: int) -> Sequence[Mark]:
        """Handles of this frame, pairs, the brush."""
        return pose_marks(self, pane) if shows_result(self.app, pane) else ()

    def tint(self, pane: int) -> Tint | None:
        """What is held, in blue."""
        return pose_tint(self, pane) if shows_result(self.app, pane) else None

    def keys(self) -> Sequence[tuple[str, str]]:
        """For the help."""
        return KEYS

    def residual(self, index: int) -> Residual | None:
        """What the solver left of a handle; None while it is not known."""
        if self._solved is None or self.draft is None or len(self._solved.handles) != len(self.draft.handles):
            return None
        return self.residuals[index] if index < len(self.residuals) else None

    def start(self, frame: int, vertex: int) -> Array:
        """Where a vertex is without the open edit, ``(3,)``."""
        if self._base is None:
            return np.asarray(self.app.editing.frame(frame, edited=True)[vertex], dtype=np.float64)
        if frame not in self._frames:
            while len(self._frames) > _MOST_FRAMES:
                self._frames.pop(next(iter(self._frames)))
            self._frames[frame] = self._base.frame(frame)
        return np.asarray(self._frames[frame][vertex], dtype=np.float64)

    def goal(self, point: PointConstraint) -> Array:
        """Where a point is to go, ``(3,)``."""
        return goal_of(point, self.start(point.frame, point.vertex))

    # -- the pointer ----------------------------------------------------------------------------------------------

    def press(self, event: Pointer) -> bool:
        """Take hold of a point, or begin to paint."""
        if not shows_result(self.app, event.pane) or not self.ready():
            return False
        if self.tool == "move":
            return self._take_hold(event)
        if self.tool == "fix" and event.hit is not None:
            self._stroke = (None, self.draft, self.app.picker(event.pane))
            self.drag(event)
            return True
        return False

    def drag(self, event: Pointer) -> None:
        """The point follows in the view plane; the brush paints on."""
        if self._grab is not None:
            place = on_plane(event, self._grab.anchor, self._grab.normal)
            if place is not None:
                self._move_to(self._grab, self._grab.goal + place - self._grab.anchor)
        elif self._stroke is not None:
            last, before, picker = self._stroke
            event = replace(event, hit=picker.along(event.origin, event.direction) or event.hit)
            self._stroke = (event, before, picker)
            self.under = (event.pane, event.hit) if event.hit is not None else None
            self._paint(last, event, picker)

    def release(self, event: Pointer) -> None:
        """The gesture is done: remember it for undo, keep it on disk, solve to the end."""
        if self._grab is not None:
            grab = self._grab
            if grab.index < 0:
                self._move_to(grab, grab.goal)  # a click: the point stays where it is
            else:
                self.drag(event)
            self._grab = None
            self.done_with(grab.before)
        elif self._stroke is not None:
            before = self._stroke[1]
            self._stroke = None
            self.done_with(before)

    def click(self, event: Pointer) -> None:
        """The distance tool picks two vertices."""
        if self.tool != "distance" or event.hit is None:
            return
        if not shows_result(self.app, event.pane):
            self.app.say("pick on the target, not on the source", "bad")
        elif self.ready():
            self._pick_pair(event.hit.vertex)

    def hover(self, event: Pointer) -> None:
        """The brush's ring follows."""
        seen = event.hit is not None and shows_result(self.app, event.pane)
        self.under = (event.pane, event.hit) if seen and event.hit is not None else None
        self.app.touch("overlay")

    def wheel(self, event: Pointer) -> bool:
        """With ctrl: the brush's size."""
        if self.tool != "fix" or "ctrl" not in event.modifiers:
            return False
        self.brush.turned(event.wheel)
        self.app.touch("overlay", "panel")
        return True

    def key(self, event: Key) -> bool:
        """Delete, commit, cancel, tools."""
        tools = {"g": "move", "d": "distance", "b": "fix"}
        if event.name in ("delete", "backspace"):
            self.delete()
        elif event.name == "enter":
            self.commit()
        elif event.name == "escape":
            return self._escape()
        elif event.name in ("[", "]"):
            self.brush.turned(-1 if event.name == "[" else 1)
        elif event.name in tools:
            self._choose_tool(tools[event.name])
        else:
            return False
        self.app.touch("panel", "overlay", "status")
        return True

    def panel(self, name: str, value: Any, final: bool) -> None:
        """A row was used, or the window on the time line."""
        if name == "window":
            if self.draft is not None:
                self.set_window(self.draft.changed(window=value), final)
        elif name.startswith("tool:"):
            self._choose_tool(name[5:])
        else:
            used(self, name, value, final)

    # -- gestures -------------------------------------------------------------------------------------------------

    def _take_hold(self, event: Pointer) -> bool:
        frame = self.app.play.frame
        points = self._points_of(frame)
        near = pointed_at(self.app, event, [self.goal(point) for _, point in points], _GRIP)
        if near >= 0:
            index, point = points[near]
            vertex, goal = point.vertex, self.goal(point)
        elif event.hit is not None:
            vertex = event.hit.vertex
            index = self.draft.find(frame, vertex) if self.draft is not None else -1
            goal = np.asarray(self.app.surface(event.pane).vertices[vertex], dtype=np.float64)
        else:
            return False
        _, _, toward = self.app.framing_camera(event.pane).axes()
        anchor = on_plane(event, goal, toward)
        if anchor is None:
            return False
        self._grab = _Grab(index, vertex, goal, anchor, toward, self.draft)
        self.selected = index
        self.app.touch("overlay", "panel")
        return True

    def _points_of(self, frame: int) -> list[tuple[int, PointConstraint]]:
        handles = self.draft.handles if self.draft is not None else ()
        return [(i, h) for i, h in enumerate(handles) if isinstance(h, PointConstraint) and h.frame == frame]

    def _move_to(self, grab: _Grab, goal: Array) -> None:
        frame = self.app.play.frame
        draft = self._begun()
        offset = goal - self.start(frame, grab.vertex)
        if grab.index < 0:
            point = PointConstraint(frame, grab.vertex, offset=_triple(offset))
            self.draft = draft.with_handle(point)
            self.selected = len(self.draft.handles) - 1
            self._grab = replace(grab, index=self.selected)
        else:
            old = draft.handles[grab.index]
            assert isinstance(old, PointConstraint)
            self.draft = draft.with_handle(replace(old, place=None, offset=_triple(offset)), grab.index)
        self.solve(live=True)

    def _pick_pair(self, vertex: int) -> None:
        if self.pending is None:
            self.pending = vertex
        elif self.pending == vertex:
            self.pending = None
        else:
            before = self.draft
            pair = DistanceConstraint(self.app.play.frame, (self.pending, vertex), factor=1.0)
            self.draft = self._begun().with_handle(pair)
            self.selected, self.pending = len(self.draft.handles) - 1, None
            self.done_with(before)
        self.app.touch("overlay", "panel", "status")

    def _paint(self, last: Pointer | None, event: Pointer, picker: Picker) -> None:
        ground = self.grounds.ground
        if ground is None:
            return
        draft = self._begun()
        dabs = self.brush.dabs(self.app, ground, last, event, "shift" in event.modifiers, picker)
        if dabs:
            hard = [replace(dab, hardness=1.0, strength=1.0) for dab in dabs]
            held = painted(ground.surface, hard, Region.whole(draft.fixed))
            self.draft = replace(draft, fixed=tuple(held.vertices.tolist()))
            self.app.touch("faces", "overlay")

    def delete(self) -> None:
        """The selected handle."""
        if self.draft is not None and 0 <= self.selected < len(self.draft.handles):
            index = self.selected
            self.selected = min(index, len(self.draft.handles) - 2)
            self.set(self.draft.without(index))

    def select(self, index: int) -> None:
        """A handle of the list; its frame is shown."""
        if self.draft is not None and 0 <= index < len(self.draft.handles):
            self.selected = index
            self.app.go_to_frame(self.draft.handles[index].frame)

    # -- the draft ------------------------------------------------------------------------------------------------

    def _begun(self) -> PoseDraft:
        """The open draft, or a new one whose window lies round this frame."""
        if self.draft is not None:
            return self.draft
        play = self.app.play
        frame, reach = play.frame, max(round(play.fps), 2)
        if play.window is None or not play.window[0] <= frame <= play.window[1]:
            play.set_window(frame - reach, frame + reach)
            self.app.touch("timeline")
        self.forget()
        return PoseDraft().changed(window=play.window)

    def request(self, live: bool = False) -> None:
        """The worker solves warm; while a point is dragged one round is enough."""
        draft = self.draft
        assert draft is not None
        self.selected = min(self.selected, len(draft.handles) - 1)
        self.beyond.ask(draft)
        constraints, number = draft.constraints(), draft.instead_of
        parameters = replace(draft.parameters, most_rounds=1) if live else draft.parameters
        known, wanted = (self._base, set(self._frames)), {*draft.frames[:_MOST_FRAMES], self.app.play.frame}

        def work(session: EditSession, progress: Progress) -> tuple[tuple[Residual, ...], Any, _Frames]:
            solved = session.draft_pose(constraints, parameters, instead_of=number, progress=progress)
            base = session.committed_state(number)
            missing = wanted - known[1] if base is known[0] else wanted
            return solved.residuals, base, {frame: base.frame(frame) for frame in missing}

        def done(found: tuple[tuple[Residual, ...], Any, _Frames]) -> None:
            self.residuals, self._solved = found[0], draft
            if self._base is not found[1]:
                self._base = found[1]
                self._frames.clear()
            self._frames.update(found[2])
            self.app.touch("overlay", "panel")

        def failed(error: Exception) -> None:
            self.residuals = ()
            self.app.say(str(error), "bad")

        self.app.editing.call("solving the edit", work, done, slot="draft", quiet=True, live=live, failed=failed)

    def _escape(self) -> bool:
        if self.app.worker.progress is not None:
            return False  # that is cancelled first
        if self._grab is not None:
            self.draft, self._grab = self._grab.before, None
            self.solve()
        elif self.pending is not None:
            self.pending = None
        elif self.draft is not None:
            self.cancel()
        else:
            return False
        self.app.touch("overlay", "panel", "status")
        return True

    def _choose_tool(self, tool: str) -> None:
        if tool not in dict(TOOLS):
            raise InputError(f"there is no tool {tool!r}", remedy=f"tools are {', '.join(dict(TOOLS))}")
        self.tool, self.pending, self.under = tool, None, None
        self.hovers = tool == "fix"
        self.app.touch("overlay", "panel", "status")


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
