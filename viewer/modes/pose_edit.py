"""Pose edit: pull points of a frame, set distances, hold parts of the face, and watch the performance follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit import Region, painted
from toolkit.pose_edit import PointConstraint
from viewer.modes.base import Tint
from viewer.modes.pose.draft import PoseDraft
from viewer.modes.pose.marks import pose_marks, pose_tint
from viewer.modes.pose.panel import KEYS, hint, pose_rows, used
from viewer.modes.pose.steps import PoseSteps
from viewer.modes.shared.ground import Grounds
from viewer.modes.shared.pointing import on_plane, pointed_at, shows_result
from viewer.picking import Picker
from viewer.state.events import Key, Pointer
from viewer.state.marks import Mark
from viewer.state.rows import Row

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["PoseEdit"]

Array = NDArray[np.float64]

_GRIP = 11.0  # pixels round a handle that take hold of it


@dataclass(frozen=True)
class _Grab:
    """A point under the pointer: the plane that it moves in, and where it was; ``index`` -1 is one to be made."""

    index: int
    vertex: int
    goal: Array
    anchor: Array
    normal: Array
    before: PoseDraft | None


class PoseEdit(PoseSteps):
    """An open edit is a `PoseDraft`; each gesture makes a new one, and the worker solves the newest."""

    name = kind = "pose"
    title = "Pose edit"
    tools = (("move", "Move"), ("distance", "Distance"), ("fix", "Hold"))
    tool_keys = {"g": "move", "d": "distance", "b": "fix"}  # noqa: RUF012  (the class's, and never changed)
    brush_tool = "fix"
    hovering = frozenset({"fix"})

    def __init__(self, app: App, grounds: Grounds) -> None:
        super().__init__(app, grounds)
        self._grab: _Grab | None = None
        self._stroke: tuple[Pointer | None, PoseDraft | None, Picker] | None = None

    def leave(self) -> None:
        """The open edit is on disk already; only a drag that was not let go is given up."""
        if self._grab is not None:
            self.draft = self._grab.before
        self._grab = self._stroke = self.under = None
        self.pending = None

    # -- what is shown --------------------------------------------------------------------------------------------

    def tool_hint(self) -> str:
        """By tool."""
        return hint(self)

    def edit_rows(self) -> Sequence[Row]:
        """Tools, handles, what is held, how it spreads, commit."""
        return pose_rows(self)

    def edit_marks(self, pane: int) -> Sequence[Mark]:
        """Handles of this frame, pairs, the brush."""
        return pose_marks(self, pane)

    def edit_tint(self, pane: int) -> Tint | None:
        """What is held, in blue."""
        return pose_tint(self, pane)

    def keys(self) -> Sequence[tuple[str, str]]:
        """For the help."""
        return KEYS

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
            self.pick_pair(event.hit.vertex)

    def edit_key(self, event: Key) -> bool:
        """Delete."""
        if event.name not in ("delete", "backspace"):
            return False
        self.delete()
        return True

    def row_used(self, name: str, value: Any, final: bool) -> None:
        """A row of the panel."""
        used(self, name, value, final)

    def choose_tool(self, tool: str) -> None:
        """Another tool; a pair that was begun is dropped."""
        self.pending = None
        super().choose_tool(tool)

    def give_up_gesture(self) -> bool:
        """A drag, or a pair that was begun."""
        if self._grab is not None:
            self.draft, self._grab = self._grab.before, None
            self.solve()
        elif self.pending is not None:
            self.pending = None
        else:
            return False
        return True

    # -- gestures -------------------------------------------------------------------------------------------------

    def _take_hold(self, event: Pointer) -> bool:
        frame = self.app.play.frame
        points = self.points_of(frame)
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

    def _move_to(self, grab: _Grab, goal: Array) -> None:
        frame = self.app.play.frame
        draft = self.begun()
        x, y, z = (float(value) for value in goal - self.start(frame, grab.vertex))
        if grab.index < 0:
            self.draft = draft.with_handle(PointConstraint(frame, grab.vertex, offset=(x, y, z)))
            self.selected = len(self.draft.handles) - 1
            self._grab = replace(grab, index=self.selected)
        else:
            old = draft.handles[grab.index]
            assert isinstance(old, PointConstraint)
            self.draft = draft.with_handle(replace(old, place=None, offset=(x, y, z)), grab.index)
        self.solve(live=True)

    def _paint(self, last: Pointer | None, event: Pointer, picker: Picker) -> None:
        ground = self.grounds.ground
        if ground is None:
            return
        draft = self.begun()
        dabs = self.brush.dabs(self.app, ground, last, event, "shift" in event.modifiers, picker)
        if dabs:
            hard = [replace(dab, hardness=1.0) for dab in dabs]
            held = painted(ground.surface, hard, Region.whole(draft.fixed))
            self.draft = replace(draft, fixed=tuple(held.vertices.tolist()))
            self.app.touch("faces", "overlay")
