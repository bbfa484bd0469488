"""What changes the open detail edit apart from the pointer: regions, lines, keys of a gain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from toolkit.detail_edit import Curve, Region, SurfacePoint, middle_of
from toolkit.editing.regions import load_regions, save_regions
from toolkit.errors import InputError
from viewer.modes.detail import drawing
from viewer.modes.detail.draft import DetailDraft
from viewer.modes.shared.ground import Ground, Grounds
from viewer.modes.shared.tools import ToolEdit

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["DetailSteps"]

_STEP = 1.5  # edges that a region grows or shrinks by at once
_STROKE_POINTS = 8


class DetailSteps(ToolEdit[DetailDraft]):
    """Changes of the draft; ``template`` is what the next one begins with."""

    def __init__(self, app: App, grounds: Grounds) -> None:
        super().__init__(app, grounds)
        self.template = DetailDraft()
        self.saved: dict[str, Region] = {}
        self.region_name = ""
        self.key_index = 0

    @property
    def current(self) -> DetailDraft:
        """The open edit, or what one would begin with."""
        return self.draft if self.draft is not None else self.template

    @property
    def height(self) -> float:
        """The face's height, in the target's unit."""
        return self.app.data.target_framing.height

    def begun(self) -> DetailDraft:
        """The open edit, or a new one at the frame that is shown."""
        if self.draft is not None:
            return self.draft
        return replace(self.template, frame=self.app.play.frame)

    def put(self, final: bool, **values: Any) -> None:
        """Other values of the open edit, or for the next one."""
        if self.draft is None:
            self.template = replace(self.template, **values)
        else:
            self.set(replace(self.draft, **values), final)

    def _close(self) -> None:
        if self.draft is not None:
            old = self.draft
            self.template = DetailDraft(
                action=old.action, factor=old.factor, width=old.width, soft=old.soft, details=old.details, band=old.band
            )
        super()._close()

    # -- the region -----------------------------------------------------------------------------------------------

    def region_changed(self, before: DetailDraft | None) -> None:
        """A gesture that began with ``before`` has changed the region."""
        if self.draft is not None:
            self.draft = self.with_start(self.draft, anew=True)
        self.done_with(before)
        self.app.touch("faces")

    def with_start(self, draft: DetailDraft, anew: bool = False) -> DetailDraft:
        """The draft with the point of its region that a copy is held by."""
        ground, region = self.grounds.ground, draft.region
        if draft.action != "paste" or ground is None or region is None or not len(region):
            return draft
        if draft.start is not None and not anew:
            return draft
        return replace(draft, start=middle_of(ground.surface, region))

    def resize(self, steps: int) -> None:
        """Grow or shrink the region by a step."""
        region = self.current.region
        if region is None:
            return

        def work(ground: Ground) -> Region:
            edge = ground.surface.edge(region.vertices) * ground.scale
            return drawing.resized(ground, region, _STEP * steps * edge)

        self._later("resizing the region", work, lambda draft, found: replace(draft, region=found))

    def mirror_region(self) -> None:
        """Select the same on the other side of the face."""
        region = self.current.region
        if region is not None:
            self._later(
                "mirroring the region",
                lambda ground: drawing.mirrored(ground, region),
                lambda draft, found: replace(draft, region=found, line=(), curve=None),
            )

    def clear_region(self) -> None:
        """Select nothing."""
        if self.draft is not None:
            self.set(replace(self.draft, region=None, line=(), curve=None, start=None, goal=None))
            self.app.touch("faces")

    def reload_regions(self) -> None:
        """Read the regions that were saved."""
        try:
            self.saved = load_regions(self.app.shot)
        except InputError as error:
            self.saved = {}
            self.app.say(str(error), "bad")

    def save_region(self) -> None:
        """Keep the region under the name that was typed."""
        name, region = self.region_name.strip(), self.current.region
        if not name:
            raise InputError("the region has no name yet", remedy="type one in")
        if region is None or not len(region):
            raise InputError("nothing is selected to be saved", remedy="paint a region, or draw a line, first")
        self.reload_regions()
        self.saved[name] = region
        save_regions(self.app.shot, self.saved)
        self.app.say(f"the region {name!r} is saved", "good")

    def load_region(self, name: str) -> None:
        """Select what was saved."""
        if not name:
            return
        if name not in self.saved:
            raise InputError(f"there is no region {name!r}", remedy=f"saved are {', '.join(self.saved) or 'none'}")
        before = self.draft
        self.draft = replace(self.begun(), region=self.saved[name], line=(), curve=None)
        self.region_name = name
        self.region_changed(before)

    def change_width(self, name: str, share: float, final: bool) -> None:
        """How far round the line the region reaches, or fades."""
        self.put(final, **{name: share})
        if self.draft is not None and self.draft.curve is not None:
            self._select_along(self.draft.curve, final)

    def _select_along(self, curve: Curve, final: bool) -> None:
        draft = self.current

        def then(now: DetailDraft, found: Region) -> DetailDraft:
            return replace(now, region=found)

        self._later(
            "selecting",
            lambda ground: drawing.region_along(ground, curve, draft.width * self.height, draft.soft * self.height),
            then,
            live=not final,
        )

    # -- lines ----------------------------------------------------------------------------------------------------

    def points_of(self, tool: str) -> tuple[SurfacePoint, ...]:
        """The points that the user gave of the line, or of the new line."""
        return self.current.goal_line if tool == "goal" else self.current.line

    def with_points(self, draft: DetailDraft, tool: str, points: tuple[SurfacePoint, ...]) -> DetailDraft:
        """The draft with other points."""
        return replace(draft, goal_line=points) if tool == "goal" else replace(draft, line=points)

    def line_given(self, tool: str, stroke: Sequence[SurfacePoint], freehand: bool) -> None:
        """A stroke is a line of its own; a click adds a point to the one that is there."""
        ground = self.grounds.ground
        if ground is None or not stroke:
            return
        before, draft = self.draft, self.begun()
        if freehand:
            spacing = max(2 * ground.surface.edge(), _length(ground, stroke) / _STROKE_POINTS)
            points = drawing.thinned(ground.surface, stroke, spacing)
        else:
            points = (*self.points_of(tool), stroke[-1])
        self.draft = self.with_points(draft, tool, points)
        self.draw_line(tool, before)

    def drop_point(self, tool: str) -> None:
        """Take the last point of a line away."""
        points = self.points_of(tool)
        if self.draft is not None and points and tool in ("line", "goal"):
            before = self.draft
            self.draft = self.with_points(self.draft, tool, points[:-1])
            self.draw_line(tool, before)

    def draw_line(self, tool: str, before: DetailDraft | None) -> None:
        """Draw a line tight through its points, and select along it; all of it one step for undo."""
        draft = self.draft
        if draft is None:
            return
        points = self.points_of(tool)
        # To bend a wrinkle that was painted, the line only says how it runs.
        keeps = tool == "goal" or (draft.action == "reshape" and draft.curve is None and bool(draft.region))
        width, soft = draft.width * self.height, draft.soft * self.height

        def work(ground: Ground) -> tuple[Curve | None, Region | None]:
            curve = drawing.line_through(ground, points)
            region = None if keeps or curve is None else drawing.region_along(ground, curve, width, soft)
            return curve, region

        def then(now: DetailDraft, found: tuple[Curve | None, Region | None]) -> DetailDraft:
            curve, region = found
            if tool == "goal":
                return replace(now, goal_curve=curve)
            return replace(now, curve=curve, region=now.region if keeps else region)

        self._later("drawing the line", work, then, before=(before,))

    # -- time -----------------------------------------------------------------------------------------------------

    def use_this_frame(self) -> None:
        """Make the frame that is shown the key frame."""
        frame, window = self.app.play.frame, self.current.window
        inside = window is None or window[0] <= frame <= window[1]
        self.put(True, frame=frame, window=window if inside else None)

    def copy_from_here(self) -> None:
        """A copy takes its wrinkle from the frame that is shown."""
        frame = self.app.play.frame
        self.put(True, source_frame=None if frame == self.current.frame else frame)

    def set_gain(self, gain: float, final: bool) -> None:
        """The chosen key's gain; the first one begins the edit."""
        draft = self.begun()
        frame = draft.gains[self.key_index][0] if self.key_index < len(draft.gains) else self.app.play.frame
        self.set(draft.with_gain(frame, gain), final)

    def add_key(self) -> None:
        """A key of the gain at the frame that is shown."""
        draft, frame = self.begun(), self.app.play.frame
        known = dict(draft.gains)
        nearest = min(known, key=lambda other: abs(other - frame), default=None)
        draft = draft.with_gain(frame, known.get(frame, known[nearest] if nearest is not None else 1.0))
        self.key_index = [key for key, _ in draft.gains].index(frame)
        self.set(draft)

    def delete_key(self) -> None:
        """The chosen key of the gain."""
        draft = self.draft
        if draft is not None and len(draft.gains) > 1 and self.key_index < len(draft.gains):
            gains = draft.gains[: self.key_index] + draft.gains[self.key_index + 1 :]
            self.key_index = max(self.key_index - 1, 0)
            self.set(replace(draft, gains=gains))

    def choose_key(self, index: int) -> None:
        """A key of the list; its frame is shown."""
        gains = self.current.gains
        if 0 <= index < len(gains):
            self.key_index = index
            self.app.go_to_frame(gains[index][0])

    # -- inside ---------------------------------------------------------------------------------------------------

    def _later(
        self,
        name: str,
        work: Callable[[Ground], Any],
        then: Callable[[DetailDraft, Any], DetailDraft],
        *,
        before: tuple[DetailDraft | None] | None = None,
        live: bool = False,
    ) -> None:
        """Work on the surface off the main thread, then change the draft by it, unless it was changed meanwhile.

        ``before`` is what undo goes back to, in a tuple; what is there now by default.
        """
        ground, asked = self.grounds.ground, self.draft
        if ground is None or asked is None:
            return
        back = before[0] if before is not None else asked

        def done(found: Any) -> None:
            if self.draft is not asked:
                return
            self.draft = then(asked, found)
            if live:
                self.solve(live=True)
                self.app.touch("faces")
            else:
                self.region_changed(back)

        def failed(error: Exception) -> None:
            if self.draft is asked:
                self.draft = back
                self.solve()
            self.app.say(str(error), "bad")

        self.app.run_task(name, lambda progress: work(ground), done, slot="drawing", quiet=True, failed=failed)


def _length(ground: Ground, points: Sequence[SurfacePoint]) -> float:
    import numpy as np

    places = np.array([ground.surface.place(point) for point in points])
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
