"""What changes the open pose edit apart from the pointer, how it is solved, and where the face is without it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.editing import EditSession
from toolkit.pose_edit import DistanceConstraint, PointConstraint, Residual
from toolkit.progress import Progress
from toolkit.shot.journal import Edit
from viewer.modes.pose.beyond import Beyond
from viewer.modes.pose.draft import PoseDraft, goal_of
from viewer.modes.shared.ground import Grounds
from viewer.modes.shared.tools import ToolEdit

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["PoseSteps"]

Array = NDArray[np.float64]
_Frames = dict[int, NDArray[np.float32]]

_MOST_FRAMES = 4


class PoseSteps(ToolEdit[PoseDraft]):
    """Changes of the draft; ``selected`` is the handle that the panel shows, ``pending`` the first end of a pair."""

    def __init__(self, app: App, grounds: Grounds) -> None:
        super().__init__(app, grounds)
        self.selected = -1
        self.pending: int | None = None
        self.residuals: tuple[Residual, ...] = ()
        self.beyond = Beyond(app)
        self._solved: PoseDraft | None = None
        self._base: Any = None
        self._frames: _Frames = {}

    def draft_from(self, data: Mapping[str, Any], number: int | None = None) -> PoseDraft:
        """Of the journal or of the file of drafts."""
        return PoseDraft.from_data(data, number)

    def begun(self) -> PoseDraft:
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

    def window_moved(self, window: tuple[int, int] | None, final: bool) -> None:
        """Weights may change in it."""
        if self.draft is not None:
            self.set_window(self.draft.changed(window=window), final)

    # -- handles --------------------------------------------------------------------------------------------------

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

    def points_of(self, frame: int) -> list[tuple[int, PointConstraint]]:
        """The points of a frame, with their places among the handles."""
        handles = self.draft.handles if self.draft is not None else ()
        return [(i, h) for i, h in enumerate(handles) if isinstance(h, PointConstraint) and h.frame == frame]

    def pick_pair(self, vertex: int) -> None:
        """One end of a pair whose distance is set, or the other."""
        if self.pending is None:
            self.pending = vertex
        elif self.pending == vertex:
            self.pending = None
        else:
            before = self.draft
            pair = DistanceConstraint(self.app.play.frame, (self.pending, vertex), factor=1.0)
            self.draft = self.begun().with_handle(pair)
            self.selected, self.pending = len(self.draft.handles) - 1, None
            self.done_with(before)
        self.app.touch("overlay", "panel", "status")

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

    # -- solving --------------------------------------------------------------------------------------------------

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
