"""Detail edit: select a wrinkle by brush or line; enhance, remove, copy or bend it; see it change at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit import DetailChange, SurfacePoint, painted
from toolkit.detail_edit.window import gain_curve
from toolkit.editing import EditSession
from toolkit.progress import Progress
from viewer.modes.base import Tint
from viewer.modes.detail.draft import DetailDraft
from viewer.modes.detail.handles import PasteRing
from viewer.modes.detail.marks import detail_marks, detail_tint
from viewer.modes.detail.panel import KEYS, detail_rows, hint, tool_of, used
from viewer.modes.detail.steps import DetailSteps
from viewer.modes.shared.ground import Grounds
from viewer.modes.shared.pointing import pointed_at, shows_result, surface_places
from viewer.picking import Picker
from viewer.state.events import Key, Pointer
from viewer.state.gestures import CLICK
from viewer.state.marks import Mark
from viewer.state.rows import Row

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["DetailEditMode"]

Array = NDArray[np.float64]

_GRIP = 10.0  # pixels round a point or a knob that take hold of it


class DetailEditMode(DetailSteps):
    """An open edit is a `DetailDraft`; each gesture makes a new one, and the worker solves the newest."""

    name = kind = "detail"
    title = "Detail edit"
    tools = (("paint", "Brush"), ("line", "Line"), ("place", "Place"), ("goal", "New line"))
    tool_keys = {"b": "paint", "c": "line", "p": "place", "n": "goal"}  # noqa: RUF012  (the class's, and never changed)
    brush_tool = "paint"
    hovering = frozenset({"paint", "line", "goal"})

    def __init__(self, app: App, grounds: Grounds) -> None:
        super().__init__(app, grounds)
        self.change: DetailChange | None = None
        self.show_region = True
        self.stroke_places: list[Array] = []
        self._stroke: list[SurfacePoint] = []
        self._gesture = ""
        self._index = -1
        self._before: DetailDraft | None = None
        self._last: Pointer | None = None
        self.picker: Picker | None = None
        self._radius: tuple[object, float] = (None, 0.0)

    # -- life -----------------------------------------------------------------------------------------------------

    def draft_from(self, data: Mapping[str, Any], number: int | None = None) -> DetailDraft:
        """Of the journal or of the file of drafts."""
        return DetailDraft.from_data(data, number)

    def leave(self) -> None:
        """The open edit is on disk already; only a gesture that was not let go is given up."""
        if self._gesture:
            self.draft = self._before
        self._drop_gesture()
        self.under = None

    def forget(self) -> None:
        """What the solver found."""
        self.change = None

    def refresh(self) -> None:
        """Another session may have another face."""
        self.reload_regions()
        super().refresh()

    # -- what is shown --------------------------------------------------------------------------------------------

    def tool_hint(self) -> str:
        """By tool."""
        return hint(self)

    def edit_rows(self) -> Sequence[Row]:
        """What to do, the region, the edit's own values, when, commit."""
        return detail_rows(self)

    def edit_marks(self, pane: int) -> Sequence[Mark]:
        """Lines, the copy's ring, the brush."""
        return detail_marks(self, pane)

    def edit_tint(self, pane: int) -> Tint | None:
        """The region."""
        return detail_tint(self, pane)

    def keys(self) -> Sequence[tuple[str, str]]:
        """For the help."""
        return KEYS

    def gain_curve(self) -> Array | None:
        """Of a gain with keys: as the solver joins them."""
        draft = self.draft
        if draft is None or draft.action != "gain" or draft.details == "static" or not draft.gains:
            return None
        return gain_curve(draft.gains, self.app.play.n_frames)

    def ring(self, pane: int) -> PasteRing | None:
        """The handles of the copy, where it goes; None before that is pointed out."""
        draft, ground = self.draft, self.grounds.ground
        if draft is None or ground is None or draft.action != "paste" or draft.goal is None or draft.start is None:
            return None
        if self._radius[0] is not draft.region:
            assert draft.region is not None
            away = ground.surface.vertices[draft.region.vertices] - ground.surface.place(draft.start)
            radius = 1.15 * ground.scale * float(np.linalg.norm(away, axis=1).max(initial=0))
            self._radius = (draft.region, max(radius, 0.01 * self.height))
        return PasteRing.at(self.app, pane, draft.goal, self._radius[1])

    # -- the pointer ----------------------------------------------------------------------------------------------

    def press(self, event: Pointer) -> bool:
        """Begin to paint, to draw or to place; beside the face the view turns."""
        if not shows_result(self.app, event.pane) or not self.ready() or self.grounds.ground is None:
            return False
        self._gesture = {"paint": self._paints, "place": self._places}.get(self.tool, self._draws)(event)
        if not self._gesture:
            return False
        # Picked on the face as it is now: the wrinkles that change under the pointer don't move it.
        self._before, self.picker, self._last = self.draft, self.app.picker(event.pane), None
        self.drag(event)
        return True

    def drag(self, event: Pointer) -> None:
        """Go on with the gesture."""
        if not self._gesture or self.picker is None:
            return
        event = replace(event, hit=self.picker.along(event.origin, event.direction) or event.hit)
        if event.hit is not None:
            self.under = (event.pane, event.hit)
        if self._gesture == "paint":
            self._paint(event)
        elif self._gesture == "knob":
            self._turn(event)
        elif event.hit is not None:
            point = SurfacePoint(event.hit.triangle, event.hit.barycentric)
            if self._gesture == "goal":
                self._place(point)
            elif self._gesture == "point":
                self._move_point(point)
            elif not self._stroke or point != self._stroke[-1]:
                self._stroke.append(point)
                self.stroke_places.append(np.asarray(event.hit.position))
        self._last = event
        self.app.touch("overlay")

    def release(self, event: Pointer) -> None:
        """The gesture is done."""
        if not self._gesture:
            return
        if event.travel > CLICK:
            self.drag(event)
        gesture, before, stroke = self._gesture, self._before, self._stroke
        self._drop_gesture()
        if gesture == "stroke":
            self.line_given(self.tool, stroke, freehand=event.travel > CLICK)
        elif gesture == "point":
            self.draw_line(self.tool, before)
        elif gesture == "paint":
            self.region_changed(before)
        else:
            self.done_with(before)

    def edit_key(self, event: Key) -> bool:
        """Hide the region, take a point of the line away."""
        if event.name == "h":
            self.show_region = not self.show_region
            self.app.touch("faces")
        elif event.name in ("delete", "backspace"):
            self.drop_point(self.tool)
        else:
            return False
        return True

    def row_used(self, name: str, value: Any, final: bool) -> None:
        """A row of the panel."""
        used(self, name, value, final)

    def window_moved(self, window: tuple[int, int] | None, final: bool) -> None:
        """The edit acts in it."""
        if self.draft is not None:
            self.set_window(replace(self.draft, window=window or (0, self.app.play.n_frames - 1)), final)

    def usable(self, tool: str) -> str:
        """Some tools are for one action only."""
        needs = {"place": "paste", "goal": "reshape"}.get(tool)
        return tool if needs in (None, self.current.action) else "paint"

    def give_up_gesture(self) -> bool:
        """What was painted or drawn since the press."""
        if not self._gesture:
            return False
        self.draft = self._before
        self._drop_gesture()
        self.solve()
        return True

    def choose_action(self, action: str) -> None:
        """Another thing to do with the region."""
        self.put(True, action=action)
        if self.draft is not None:
            self.draft = self.with_start(self.draft)
        self.choose_tool(tool_of(action, self.current))

    # -- gestures -------------------------------------------------------------------------------------------------

    def _paints(self, event: Pointer) -> str:
        return "paint" if event.hit is not None else ""

    def _places(self, event: Pointer) -> str:
        if self.draft is None or self.draft.region is None or not len(self.draft.region):
            self.app.say("paint the wrinkle first", "bad")
            return ""
        ring = self.ring(event.pane)
        if ring is not None:
            knob = ring.knob(self.draft.rotation, self.draft.scale)
            if pointed_at(self.app, event, [knob], _GRIP) == 0:
                return "knob"
        return "goal" if event.hit is not None else ""

    def _draws(self, event: Pointer) -> str:
        points = self.points_of(self.tool)
        if points:
            triangles, weights = [point.triangle for point in points], [point.weights for point in points]
            self._index = pointed_at(
                self.app, event, list(surface_places(self.app, event.pane, triangles, weights)), _GRIP
            )
            if self._index >= 0:
                return "point"
        return "stroke" if event.hit is not None else ""

    def _paint(self, event: Pointer) -> None:
        ground = self.grounds.ground
        if ground is None:
            return
        assert self.picker is not None
        draft = self.begun()
        erase = "shift" in event.modifiers
        dabs = self.brush.dabs(self.app, ground, self._last, event, erase, self.picker)
        if not dabs:
            return
        self.draft = replace(draft, region=painted(ground.surface, dabs, draft.region))
        if self.draft.action == "scale" and not self.draft.empty:
            self.solve(live=True)
        self.app.touch("faces", "panel")

    def _turn(self, event: Pointer) -> None:
        ring = self.ring(event.pane)
        turned = ring.turned(event) if ring is not None else None
        if turned is not None and self.draft is not None:
            self.draft = replace(self.draft, rotation=turned[0], scale=turned[1])
            self.solve(live=True)

    def _place(self, point: SurfacePoint) -> None:
        if self.draft is not None:
            self.draft = replace(self.with_start(self.draft), goal=point)
            self.solve(live=True)

    def _move_point(self, point: SurfacePoint) -> None:
        points = list(self.points_of(self.tool))
        if self.draft is not None and 0 <= self._index < len(points):
            points[self._index] = point
            self.draft = self.with_points(self.draft, self.tool, tuple(points))

    def _drop_gesture(self) -> None:
        self._gesture, self._stroke, self.stroke_places = "", [], []
        self._before, self.picker, self._last = None, None, None
        self.app.touch("overlay")

    # -- solving --------------------------------------------------------------------------------------------------

    def request(self, live: bool = False) -> None:
        """The worker solves the newest; while painting the window stays as it was found."""
        draft = self.draft
        assert draft is not None
        number = draft.instead_of
        edit = draft.edit()
        if live and draft.action != "gain" and draft.window is None and self.change is not None:
            first, last = self.change.window
            if first <= draft.frame <= last:
                edit = replace(draft, window=(first, last)).edit()

        def work(session: EditSession, progress: Progress) -> DetailChange:
            return session.draft_detail(edit, instead_of=number)

        def done(change: DetailChange) -> None:
            self.change = change
            now = self.draft
            if now is not None and now.window is None and now.action != "gain" and now.details == "dynamic":
                self.app.play.window = change.window
            self.app.touch("overlay", "panel", "timeline")

        def failed(error: Exception) -> None:
            self.change = None
            self.app.say(str(error), "bad")

        self.app.editing.call("solving the edit", work, done, slot="draft", quiet=True, live=live, failed=failed)
