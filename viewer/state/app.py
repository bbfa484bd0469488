"""The application without its window: everything that is shown, and what every event does to it.

The view asks for `surface`, `base_colors`, `marks`, `rows` and so on after it was told what changed (`take_changes`),
and hands events to `handle`. Tests do the same without a display.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.progress import Progress
from toolkit.shot import Shot
from viewer.compiled import load_compiled
from viewer.modes.base import Mode, Tint
from viewer.saver import Saver
from viewer.state import commands, look
from viewer.state.cameras import Viewpoint
from viewer.state.events import Event, Key, PanelInput, Pointer, TimelineInput
from viewer.state.fields import Field
from viewer.state.gestures import Gestures
from viewer.state.maps import Maps
from viewer.state.marks import Mark
from viewer.state.nets import Nets
from viewer.state.panes import PAIRS, Pair
from viewer.state.rows import Row
from viewer.state.scene import Scene
from viewer.state.session import Editing
from viewer.state.shot_data import ShotData
from viewer.state.steps import Steps, find_steps
from viewer.timeline import Timeline
from viewer.worker import Task, Worker

__all__ = ["App"]

log = logging.getLogger(__name__)

ALL = frozenset({"faces", "overlay", "panel", "timeline", "camera", "status"})


class App(Scene):
    """One shot, open.

    Parameters
    ----------
    shot : the shot folder
    worker : where long work goes; the caller stops it at the end
    """

    def __init__(self, shot: Shot, worker: Worker) -> None:
        from viewer.modes.catalogue import make_modes

        super().__init__(ShotData(shot), Editing(self))
        self.shot = shot
        self.worker = worker
        worker.on_error = self._task_failed
        self.saver = Saver(lambda error: self.say(f"not saved: {error}", "bad"))
        self.steps: Steps | None = None
        self.wireframe = False
        self.maps = Maps(self)
        self.nets = Nets(self)
        self.basis = 0
        self.help_shown = False
        self.message, self.tone = "", "plain"
        self.solve_seconds: float | None = None
        self.quit_asked = False
        self._running = False
        self._gestures = Gestures(self)
        self._changes: set[str] = set(ALL)
        self.modes: dict[str, Mode] = {mode.name: mode for mode in make_modes(self)}
        self.mode = self.modes["landmarks" if not self.data.has_registration else "look"]
        _ = self.data.target  # read before there is a window that could stand still
        load_compiled()
        self.mode.enter()
        self.nets.prepare()
        self.check_steps()

    # -- what changed ---------------------------------------------------------------------------------------------

    def touch(self, *what: str) -> None:
        """Something has to be drawn again: faces, overlay, panel, timeline, camera, status; all without a name."""
        self._changes |= set(what) or set(ALL)

    def take_changes(self) -> set[str]:
        """What is to be drawn again since the last call."""
        changes, self._changes = self._changes, set()
        return changes

    def faces_changed(self) -> None:
        """The shapes of faces are not what they were, at the same frame."""
        self.forget_surfaces()
        self.touch("faces", "overlay", "timeline")

    def say(self, message: str, tone: str = "plain") -> None:
        """Put words into the status line; ``tone`` is plain, good or bad."""
        self.message, self.tone = message, tone
        self.touch("status")

    def solved(self, seconds: float) -> None:
        """The last solve took this long."""
        self.solve_seconds = seconds
        self.touch("status")

    # -- what is shown --------------------------------------------------------------------------------------------

    def base_colors(self, pane: int) -> NDArray[np.float32]:
        """Colours of a pane's surface before it is lit, ``(V, 3)`` or ``(1, 3)``."""
        field = self.field(pane)
        surface = self.surface(pane)
        base = field.colors() if field is not None else self.skin(surface)
        tint = self.mode.tint(pane)
        return _blended(base, tint, len(surface.vertices)) if tint is not None else base

    def field(self, pane: int) -> Field | None:
        """The colour map of a pane, if it has one; the right pane's only."""
        return None if pane == 0 or self.map == "none" else self.maps.field(self.map)

    def edges(self, pane: int) -> NDArray[np.int32] | None:
        """The edges of a pane's mesh ``(E, 2)``, without the diagonals of its quads; None while they are looked for."""
        return self.nets.edges(self.surface(pane).mesh)

    def marks(self, pane: int) -> Sequence[Mark]:
        """What is drawn on top of a pane's face."""
        return self.mode.marks(pane)

    def rows(self) -> list[Row]:
        """The whole panel."""
        return look.panel_rows(self)

    def timeline(self) -> Timeline:
        """What the time line shows."""
        return look.timeline_of(self)

    def status_line(self) -> tuple[str, str]:
        """Words and their tone: what happened last, what a click will do, how long the last solve took."""
        return look.status_line(self)

    # -- events ---------------------------------------------------------------------------------------------------

    def handle(self, event: Event) -> None:
        """Do what an event means. What the user gets wrong is said in the status line, never raised."""
        try:
            if isinstance(event, Pointer):
                self._gestures.handle(event)
            elif isinstance(event, Key):
                commands.key(self, event)
            elif isinstance(event, PanelInput):
                commands.panel(self, event)
            elif isinstance(event, TimelineInput):
                commands.timeline(self, event)
            else:
                commands.run(self, event)
        except InputError as error:
            self.say(str(error), "bad")

    def tick(self, seconds: float) -> None:
        """Let time pass: playback, and results of long work."""
        if self.worker.drain():
            self.touch("status")
        self.saver.drain()
        running = self.worker.progress is not None
        if running:
            self.touch("status")
        if running is not self._running:
            self._running = running
            self.touch("status", "panel")  # to cancel it
        if self.play.advance(seconds, self._ready):
            self._frame_changed()
        if self.play.playing:
            self.editing.build_ahead(self.wanted())
        if self.arrived():
            self.touch("faces", "overlay")

    def _ready(self, frame: int) -> bool:
        return all(self.editing.ready(frame, edited) for edited in self.wanted())

    def go_to_frame(self, frame: int) -> None:
        """Show another frame."""
        if frame != self.play.frame:
            self.play.go(frame)
            self._frame_changed()

    def step(self, count: int) -> None:
        """Step by frames and stop playing."""
        self.play.step(count)
        self._frame_changed()

    def choose_mode(self, name: str) -> None:
        """Turn to another mode."""
        if name not in self.modes:
            raise InputError(f"there is no mode {name!r}", remedy=f"modes are {', '.join(self.modes)}")
        if self.modes[name] is self.mode:
            return
        self.mode.leave()
        self.mode = self.modes[name]
        self.message = ""
        if self.mode.pairs and self.pair.name not in self.mode.pairs:
            wanted = next((p for p in self.mode.pairs if self.can_show(PAIRS[p])), None)
            if wanted is not None:
                self.choose_pair(wanted)
        self.mode.enter()
        self.touch()

    def can_show(self, pair: Pair) -> bool:
        """Whether the shot has come far enough for a pair."""
        return {"": True, "result": self.data.has_result, "registration": self.data.has_registration}[pair.needs]

    def choose_pair(self, name: str) -> None:
        """Show another pair of surfaces."""
        if name not in PAIRS:
            raise InputError(f"there is no view {name!r}", remedy=f"views are {', '.join(PAIRS)}")
        if not self.can_show(PAIRS[name]):
            raise InputError(f"{PAIRS[name].words} cannot be shown yet", remedy="run the steps that are still to do")
        self.pair = PAIRS[name]
        self.map = self.maps.sensible(self.pair.map)
        self.touch()

    def frame_face(self) -> None:
        """Look straight at the whole face."""
        self.views = [Viewpoint(), Viewpoint()]
        self.touch("camera", "faces", "overlay")

    def set_view(self, pane: int, view: Viewpoint) -> None:
        """Turn one pane, and with it the other if they are linked."""
        if self.linked:
            self.views = [view, view]
        else:
            self.views[pane] = view
        self.touch("camera", "faces", "overlay")

    # -- long work ------------------------------------------------------------------------------------------------

    @property
    def busy(self) -> bool:
        """Whether anything runs, waits to run or is not on disk yet."""
        return self.worker.busy or self.saver.busy

    def run_task(
        self,
        name: str,
        work: Callable[..., Any],
        done: Callable[[Any], None],
        *,
        slot: str | None = None,
        quiet: bool = False,
        failed: Callable[[Exception], None] | None = None,
    ) -> None:
        """Do ``work(progress)`` off the main thread, then ``done(result)`` on it."""
        self.worker.submit(Task(name, work, done, failed, slot, quiet))
        self.touch("status", "panel")

    def check_steps(self) -> None:
        """Find out which stages are up to date."""

        def done(steps: Steps) -> None:
            first = self.steps is None
            self.steps = steps
            if first or steps.done("transfer"):
                self.editing.open_if_ready()
            self.touch("panel", "status")

        def work(progress: Progress) -> Steps:
            self.saver.flush()
            self.shot.remove_leftovers()
            return find_steps(self.shot)

        self.run_task("looking at the shot", work, done, slot="steps", quiet=True)

    def refresh_modes(self) -> None:
        """Let every mode read again what it keeps of the shot, which is on disk by then."""
        self.saver.flush()
        for mode in self.modes.values():
            mode.refresh()

    def reload(self) -> None:
        """Stages were run: read the shot again."""
        self.shot = Shot(self.shot.path)
        self.data = ShotData(self.shot, self.data)
        self.play.n_frames, self.play.fps = self.data.n_frames, self.data.fps
        self.forget_surfaces(stills=True)
        self.maps.forget()
        self.editing.close()
        self.refresh_modes()
        if not self.can_show(self.pair):
            self.choose_pair("references")
        self.faces_changed()
        self.touch()
        self.check_steps()

    def result_written(self) -> None:
        """result/frames.npy is another: read it again."""
        self.data = ShotData(self.shot, self.data)
        self.faces_changed()
        self.check_steps()

    # -- inside ---------------------------------------------------------------------------------------------------

    def _frame_changed(self) -> None:
        self.mode.frame_changed()
        self.touch("faces", "overlay", "timeline")
        if not self.play.playing:
            self.touch("panel")

    def _task_failed(self, name: str, error: Exception) -> None:
        self.say(str(error) if isinstance(error, InputError) else f"{name}: {error}", "bad")
        self.touch("panel")


def _blended(base: NDArray[np.float32], tint: Tint, count: int) -> NDArray[np.float32]:
    colors, share = tint
    full = np.broadcast_to(base, (count, 3))
    amount = np.asarray(share, dtype=np.float32)[:, None]
    return np.ascontiguousarray(full * (1 - amount) + np.asarray(colors, dtype=np.float32) * amount)
