"""The application without its window: everything that is shown, and what every event does to it.

The view asks for `surface`, `colors`, `marks`, `rows` and so on after it was told what changed (`take_changes`), and
hands events to `handle`. Tests do the same without a display.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh.topology import unique_edges
from toolkit.rendering import Camera
from toolkit.shot import Shot
from viewer.modes.base import Mode, Tint
from viewer.picking import Picker
from viewer.shading import CLAY, SKIN, Light
from viewer.state import commands, look
from viewer.state.cameras import Viewpoint
from viewer.state.coating import Coating
from viewer.state.events import Event, Hit, Key, PanelInput, Pointer, TimelineInput
from viewer.state.fields import Field, scaled
from viewer.state.marks import Mark
from viewer.state.panes import PAIRS, Pair, Surface
from viewer.state.playhead import Playhead
from viewer.state.rows import Row
from viewer.state.session import Editing
from viewer.state.shot_data import ShotData
from viewer.state.steps import Steps, find_steps
from viewer.timeline import Timeline
from viewer.worker import Task, Worker

__all__ = ["CLICK", "App"]

log = logging.getLogger(__name__)

CLICK = 0.006
"""A press that travels less than this share of the pane's height is a click."""

ALL = frozenset({"faces", "overlay", "panel", "timeline", "camera", "status"})


class App:
    """One shot, open.

    Parameters
    ----------
    shot : the shot folder
    worker : where long work goes; the caller stops it at the end
    """

    def __init__(self, shot: Shot, worker: Worker) -> None:
        from viewer.modes.catalogue import make_modes

        self.shot = shot
        self.worker = worker
        worker.on_error = self._task_failed
        self.data = ShotData(shot)
        self.play = Playhead(self.data.n_frames, self.data.fps)
        self.editing = Editing(self)
        self.steps: Steps | None = None
        self.views = [Viewpoint(), Viewpoint()]
        self.linked = True
        self.light = Light()
        self.wireframe = False
        self.map = "none"
        self.pair: Pair = PAIRS["performance" if self.data.has_result else "references"]
        self.basis = 0
        self.pane_sizes = [(700, 700), (700, 700)]
        self.help_shown = False
        self.message, self.tone = "", "plain"
        self.solve_seconds: float | None = None
        self.quit_asked = False
        self._changes: set[str] = set(ALL)
        self._capture = ""
        self._surfaces: dict[str, tuple[Any, Surface]] = {}
        self._pickers: dict[str, tuple[Surface, Picker]] = {}
        self._fields: dict[str, tuple[Any, Field]] = {}
        self._coating = Coating(shot.config.smoothing)
        self._coating_of: Surface | None = None
        self._revision = 0
        self.modes: dict[str, Mode] = {mode.name: mode for mode in make_modes(self)}
        self.mode = self.modes["landmarks" if not self.data.has_registration else "look"]
        self.mode.enter()
        self._warm_up()
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
        self._revision += 1
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

    def surface(self, pane: int) -> Surface:
        """The face in a pane, at the present frame."""
        return self.surface_named(self.pair.right if pane else self.pair.left)

    def surface_named(self, name: str) -> Surface:
        """A surface of `PAIRS` at the present frame; kept until the frame or the shot changes."""
        still = name in ("source reference", "target reference", "registered")
        key = (self._revision, None if still else self.play.frame)
        known = self._surfaces.get(name)
        if known is None or known[0] != key:
            known = self._surfaces[name] = (key, self._make_surface(name))
        return known[1]

    def extras(self, pane: int) -> tuple[NDArray[np.float32], NDArray[np.int32]] | None:
        """What belongs beside the face in a pane, eyeballs for one: positions (N, 3) and triangles (F, 3)."""
        name = self.pair.right if pane else self.pair.left
        extras = self.data.source_extras if name.startswith("source") else self.data.target_extras
        if extras is None:
            return None
        still = "reference" in name or name == "registered"
        places = extras.rest if still else extras.frame(self.play.frame)
        return places.astype(np.float32), extras.triangles

    def edges(self, pane: int) -> NDArray[np.int32]:
        """The edges of a pane's mesh ``(E, 2)``, without the diagonals of its quads."""
        mesh = self.data.source if self.surface(pane).mesh == "source" else self.data.target
        if mesh.polygons is None:
            return unique_edges(mesh.triangles).astype(np.int32)
        ends = np.cumsum(mesh.polygons.counts)
        following = np.arange(1, ends[-1] + 1)
        following[ends - 1] = ends - mesh.polygons.counts
        pairs = np.stack([mesh.polygons.indices, mesh.polygons.indices[following]], axis=1)
        return np.unique(np.sort(pairs, axis=1), axis=0).astype(np.int32)

    def framing_camera(self, pane: int) -> Camera:
        """The camera of a pane."""
        return self.views[0 if self.linked else pane].camera(self.surface(pane).framing)

    def base_colors(self, pane: int) -> NDArray[np.float32]:
        """Colours of a pane's surface before it is lit, ``(V, 3)`` or ``(1, 3)``."""
        field = self.field(pane)
        surface = self.surface(pane)
        if field is not None:
            base = field.colors()
        else:
            still = "reference" in surface.name or surface.name == "registered"
            base = look.skin_of(self, surface, CLAY if still else SKIN)
        tint = self.mode.tint(pane)
        return _blended(base, tint, len(surface.vertices)) if tint is not None else base

    def field(self, pane: int) -> Field | None:
        """The colour map of a pane, if it has one; the right pane's only."""
        if pane == 0 or self.map == "none":
            return None
        return look.field_of(self, self.map)

    def kept_field(self, key: tuple[Any, ...], make: Callable[[], Field]) -> Field:
        """A field that stays as it is until the shot changes."""
        known = self._fields.get(str(key[0]))
        if known is None or known[0] != key:
            known = self._fields[str(key[0])] = (key, make())
        return known[1]

    def coating_field(self, surface: Surface) -> Field | None:
        """The coating's magnitude on a surface; found in the worker, the last one is shown until then."""
        if self._coating_of is not surface and not self.play.playing:
            self._coating_of = surface
            self.run_task(
                "measuring the coating",
                lambda progress: self._coating.measure(surface.vertices, surface.triangles),
                lambda values: self._coating_found(surface, values),
                slot="coating",
                quiet=True,
            )
        known = self._fields.get("coating")
        return known[1] if known is not None and len(known[1].values) == len(surface.vertices) else None

    def _coating_found(self, surface: Surface, values: NDArray[np.floating]) -> None:
        field = scaled("coating", values, "the target's unit")
        known = self._fields.get("coating")
        if known is not None and known[1].scale.high >= field.scale.high > 0.2 * known[1].scale.high:
            field = replace(field, scale=known[1].scale)  # one scale for the whole take, or nothing can be compared
        self._fields["coating"] = (surface, field)
        self.touch("faces")

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

    # -- picking --------------------------------------------------------------------------------------------------

    def picker(self, pane: int) -> Picker:
        """The picker of the face as displayed; built when first asked for."""
        surface = self.surface(pane)
        known = self._pickers.get(surface.name)
        if known is None or known[0] is not surface:
            same = next((p for s, p in self._pickers.values() if s.triangles is surface.triangles), None)
            picker = same.moved(surface.vertices) if same else Picker(surface.vertices, surface.triangles)
            known = self._pickers[surface.name] = (surface, picker)
        return known[1]

    def pick(self, pane: int, x: float, y: float) -> Hit | None:
        """What a pixel of a pane shows."""
        return self.picker(pane).pick(self.framing_camera(pane), x, y, self.pane_sizes[pane])

    def pixel(self, pane: int, position: Sequence[float]) -> tuple[float, float]:
        """Where a place is seen in a pane, in its pixels."""
        x, y, _ = self.framing_camera(pane).project(np.asarray(position)[None], self.pane_sizes[pane])[0]
        return float(x), float(y)

    # -- events ---------------------------------------------------------------------------------------------------

    def handle(self, event: Event) -> None:
        """Do what an event means. What the user gets wrong is said in the status line, never raised."""
        try:
            if isinstance(event, Pointer):
                self._pointer(event)
            elif isinstance(event, Key):
                commands.key(self, event)
            elif isinstance(event, PanelInput):
                commands.panel(self, event)
            elif isinstance(event, TimelineInput):
                self._timeline(event)
            else:
                commands.run(self, event)
        except InputError as error:
            self.say(str(error), "bad")

    def tick(self, seconds: float) -> None:
        """Let time pass: playback, and results of long work."""
        if self.worker.drain():
            self.touch("status")
        if self.worker.progress is not None:
            self.touch("status")
        if self.play.advance(seconds):
            self._frame_changed()
        if self.play.playing:
            self.editing.build_ahead()

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
        self.map = look.sensible_map(self, self.pair.map)
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

        self.run_task("looking at the shot", lambda progress: find_steps(self.shot), done, slot="steps", quiet=True)

    def reload(self) -> None:
        """Stages were run: read the shot again."""
        self.shot = Shot(self.shot.path)
        self.data = ShotData(self.shot, self.data)
        self.play.n_frames, self.play.fps = self.data.n_frames, self.data.fps
        self._surfaces.clear()
        self._fields.clear()
        self.editing.close()
        for mode in self.modes.values():
            mode.refresh()
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

    def _warm_up(self) -> None:
        """Read and prepare what the first click would wait for."""
        _ = self.data.target  # before there is a window that could stand still
        faces = [self.surface(pane) for pane in (0, 1)]

        def done(pickers: list[Picker]) -> None:
            for surface, picker in zip(faces, pickers, strict=True):
                self._pickers.setdefault(surface.name, (surface, picker))

        self.run_task(
            "preparing",
            lambda progress: [Picker(f.vertices, f.triangles) for f in faces],
            done,
            slot="warm",
            quiet=True,
        )

    # -- inside ---------------------------------------------------------------------------------------------------

    def _make_surface(self, name: str) -> Surface:
        data, frame = self.data, self.play.frame
        if name == "target reference":
            mesh = data.target
            return Surface(name, "target", mesh.vertices.astype(np.float32), mesh.triangles, data.target_framing)
        triangles = data.source.triangles
        if name == "source reference":
            vertices, framing = data.source.vertices.astype(np.float32), data.source_framing
        elif name == "source":
            vertices, framing = np.asarray(data.source_frame(frame), np.float32), data.source_framing
        elif name == "registered":
            vertices, framing = data.registered, data.target_framing
        elif name == "before":
            vertices, framing = self.editing.unedited(frame), data.target_framing
        else:
            vertices, framing = self.editing.edited(frame), data.target_framing
        return Surface(name, "source", np.ascontiguousarray(vertices, dtype=np.float32), triangles, framing)

    def _frame_changed(self) -> None:
        self.mode.frame_changed()
        self.touch("faces", "overlay", "timeline")
        if not self.play.playing:
            self.touch("panel")

    def _pointer(self, event: Pointer) -> None:
        if event.kind == "wheel":
            if self.mode.wheel(event):
                return
            self.set_view(event.pane, self._view_of(event.pane).zoomed(event.wheel, self._under(event)))
        elif event.kind == "hover":
            self.mode.hover(event)
        elif event.kind == "press":
            kept = event.button == "left" and "alt" not in event.modifiers and self.mode.press(event)
            self._capture = "mode" if kept else _gesture(event)
        elif event.kind == "drag":
            self._drag(event)
        elif event.kind == "release":
            captured, self._capture = self._capture, ""
            if captured == "mode":
                self.mode.release(event)
            elif event.button == "left" and event.travel <= CLICK:
                self.mode.click(event)

    def _drag(self, event: Pointer) -> None:
        view = self._view_of(event.pane)
        if self._capture == "mode":
            self.mode.drag(event)
        elif self._capture == "orbit":
            self.set_view(event.pane, view.orbited(*event.moved))
        elif self._capture == "pan":
            self.set_view(event.pane, view.panned(*event.moved))
        elif self._capture == "light":
            turned = (self.light.azimuth + 180 * event.moved[0], self.light.elevation + 180 * event.moved[1])
            self.light = replace(
                self.light,
                azimuth=float((turned[0] + 180) % 360 - 180),
                elevation=float(np.clip(turned[1], -89, 89)),
            )
            self.touch("faces", "panel")

    def _under(self, event: Pointer) -> NDArray[np.float64]:
        """What the pointer is over, in the plane through what is looked at: from the face's centre, in its heights."""
        framing, camera = self.surface(event.pane).framing, self.framing_camera(event.pane)
        toward = camera.axes()[2]
        origin, direction = np.asarray(event.origin), np.asarray(event.direction)
        reach = float((np.asarray(camera.target) - origin) @ toward) / min(float(direction @ toward), -1e-6)
        place = origin + reach * direction
        return np.asarray((place - np.asarray(framing.centre)) @ np.asarray(framing.axes).T / framing.height)

    def _view_of(self, pane: int) -> Viewpoint:
        return self.views[0 if self.linked else pane]

    def _timeline(self, event: TimelineInput) -> None:
        if event.what == "scrub":
            self.play.playing = False
            self.go_to_frame(event.frame)
            return
        first, last = self.play.window or (0, self.play.n_frames - 1)
        if event.what == "first":
            self.play.set_window(min(event.frame, last), last)
        elif event.what == "last":
            self.play.set_window(first, max(event.frame, first))
        elif event.what == "window":
            half = (last - first) // 2
            start = min(max(event.frame - half, 0), self.play.n_frames - 1 - (last - first))
            self.play.set_window(start, start + last - first)
        self.mode.panel("window", self.play.window, event.grip == "release")
        self.touch("timeline", "panel")

    def _task_failed(self, name: str, error: Exception) -> None:
        self.say(str(error) if isinstance(error, InputError) else f"{name}: {error}", "bad")
        self.touch("panel")


def _gesture(event: Pointer) -> str:
    """What a drag does that the mode left alone."""
    if event.button == "middle" or (event.button == "right" and "ctrl" not in event.modifiers):
        return "pan"
    if event.button == "right":
        return "light"
    return "pan" if "ctrl" in event.modifiers else "orbit"


def _blended(base: NDArray[np.float32], tint: Tint, count: int) -> NDArray[np.float32]:
    colors, share = tint
    full = np.broadcast_to(base, (count, 3))
    amount = np.asarray(share, dtype=np.float32)[:, None]
    return np.ascontiguousarray(full * (1 - amount) + np.asarray(colors, dtype=np.float32) * amount)
