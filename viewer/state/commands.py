"""Keys, the panel's common rows, menu entries and script commands: what each does to the application."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

from toolkit.errors import InputError
from toolkit.progress import Progress
from viewer.stages_process import run_in_process
from viewer.state.events import Command, Key, PanelInput, TimelineInput
from viewer.state.fields import MAPS
from viewer.state.panes import PAIRS
from viewer.state.playhead import SPEEDS
from viewer.worker import Cancelled

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["key", "panel", "redo", "run", "timeline", "undo"]


def key(app: App, event: Key) -> None:
    """A key was pressed."""
    shift = "shift" in event.modifiers
    name = event.name
    if name == "q" and "ctrl" in event.modifiers:
        run(app, Command("quit"))
    elif name == "?" or (name == "/" and shift):
        run(app, Command("help"))
    elif name in _KEYS and not (name == "escape" and app.mode.key(event)):
        _KEYS[name](app, shift)
    elif name.isdigit() and 1 <= int(name) <= len(app.modes):
        app.choose_mode(list(app.modes)[int(name) - 1])
    else:
        app.mode.key(event)


def panel(app: App, event: PanelInput) -> None:
    """A row of the panel was used: the common ones here, the others are the mode's."""
    name, value = event.name, event.value
    if name.startswith("mode:"):
        app.choose_mode(name[5:])
    elif name.startswith("run:"):
        run(app, Command("run", name[4:]))
    elif name.startswith("light:"):
        app.light = replace(app.light, **{name[6:]: float(value)})
        app.touch("faces")
    elif name in _COMMANDS:
        run(app, Command(name, value))
    else:
        app.mode.panel(name, value, event.final)
        app.touch("panel", "overlay", "status")


def run(app: App, command: Command) -> None:
    """A command of a menu or a script."""
    if command.name not in _COMMANDS:
        raise InputError(f"there is no command {command.name!r}", remedy=f"commands are {', '.join(_COMMANDS)}")
    _COMMANDS[command.name](app, command.argument)


def timeline(app: App, event: TimelineInput) -> None:
    """The time line was used: another frame, or the window's ends."""
    if event.what == "scrub":
        app.play.playing = False
        app.go_to_frame(event.frame)
        return
    first, last = app.play.window or (0, app.play.n_frames - 1)
    if event.what == "first":
        app.play.set_window(min(event.frame, last), last)
    elif event.what == "last":
        app.play.set_window(first, max(event.frame, first))
    elif event.what == "window":
        half = (last - first) // 2
        start = min(max(event.frame - half, 0), app.play.n_frames - 1 - (last - first))
        app.play.set_window(start, start + last - first)
    app.mode.panel("window", app.play.window, event.grip == "release")
    app.touch("timeline", "panel")


def undo(app: App, _: Any = None) -> None:
    """Take back the last thing: of the mode, or of the journal."""
    _step(app, "undo", "undone")


def redo(app: App, _: Any = None) -> None:
    """Do again what was taken back."""
    _step(app, "redo", "done again")


def _step(app: App, name: Literal["undo", "redo"], done: str) -> None:
    """Through what the mode remembers first, then through the journal."""
    if getattr(app.mode, name)():
        app.touch("overlay", "panel", "faces")
        return
    words = getattr(app.editing.snapshot, f"can_{name}", None)
    if words is None:
        app.say(f"there is nothing to {name}")
        return
    app.editing.call(name, lambda session, _: getattr(session, name)(), lambda _: app.say(f"{done}: {words}"))


def _run_stages(app: App, which: Any) -> None:
    stages = [] if which in (None, "all") else [str(which)]
    folder = app.shot.path
    app.mode.leave()  # nothing half done is left out
    app.mode.enter()

    def work(progress: Progress) -> list[dict[str, Any]]:
        app.saver.flush()
        return run_in_process(folder, stages, progress)

    def done(reports: list[dict[str, Any]]) -> None:
        seconds = sum(float(report["seconds"]) for report in reports)
        ran = [report["stage"] for report in reports if not report["skipped"]]
        app.say(f"{', '.join(ran) or 'nothing to do'}: done in {seconds:.1f} s", "good")
        app.reload()
        made = next((pair for stage, pair in _MADE.items() if stage in ran), None)
        if made is not None:
            if app.mode.pairs and made not in app.mode.pairs:
                app.choose_mode("look")
            app.choose_pair(made)

    def failed(error: Exception) -> None:
        stopped = isinstance(error, Cancelled)
        app.say("stopped; what was finished is kept" if stopped else str(error), "bad")
        app.reload()

    app.run_task("running", work, done, failed=failed)


_MADE = {"result": "performance", "register": "registration"}
"""The last stage that was run, and the views to look at it with."""


def _escape(app: App, shift: bool) -> None:
    if app.worker.progress is not None:
        app.worker.cancel()
        app.say("cancelling")
    elif app.help_shown:
        run(app, Command("help"))


def _toggle(attribute: str, *what: str) -> Callable[[App, Any], None]:
    def toggle(app: App, value: Any = None) -> None:
        setattr(app, attribute, (not getattr(app, attribute)) if value is None else bool(value))
        app.touch(*what)

    return toggle


def _play(app: App, _: Any = None) -> None:
    app.play.toggle()
    app.touch("timeline", "panel", "faces")


def _link(app: App, value: Any = None) -> None:
    app.linked = (not app.linked) if value is None else bool(value)
    app.views[1] = app.views[0]
    app.touch("camera", "faces", "overlay", "panel")


def _map(app: App, name: Any) -> None:
    if name not in dict(MAPS):
        raise InputError(f"there is no colour map {name!r}", remedy=f"maps are {', '.join(dict(MAPS))}")
    app.map = name
    app.touch("faces", "panel")


def _next_pair(app: App, shift: bool) -> None:
    names = [pair.name for pair in PAIRS.values() if app.can_show(pair)]
    here = names.index(app.pair.name) if app.pair.name in names else 0
    app.choose_pair(names[(here + (-1 if shift else 1)) % len(names)])


def _speed(app: App, value: Any) -> None:
    app.play.speed = min(SPEEDS, key=lambda speed: abs(speed - float(value)))
    app.touch("timeline")


def _loop(app: App, value: Any = None) -> None:
    app.play.loop = (not app.play.loop) if value is None else bool(value)
    app.touch("timeline")


def _view(app: App, values: Any) -> None:
    known = {"azimuth", "elevation", "distance", "shift"}
    given = {name: value for name, value in dict(values).items() if name in known}
    if "shift" in given:
        given["shift"] = tuple(float(v) for v in given["shift"])
    app.set_view(0, replace(app.views[0], **given))


def _window(app: App, values: Any) -> None:
    if values is None:
        app.play.window = None
    else:
        app.play.set_window(*values)
    app.mode.panel("window", app.play.window, True)
    app.touch("timeline", "panel")


def _basis(app: App, value: Any) -> None:
    app.basis = int(value)
    app.touch("timeline")


def _quit(app: App, _: Any = None) -> None:
    app.mode.leave()
    app.quit_asked = True


def _cancel(app: App, _: Any = None) -> None:
    app.worker.cancel()


def _check(app: App, _: Any = None) -> None:
    app.check_steps()


_KEYS: dict[str, Callable[[Any, bool], None]] = {
    "space": _play,
    "left": lambda app, shift: app.step(-10 if shift else -1),
    "right": lambda app, shift: app.step(10 if shift else 1),
    "home": lambda app, shift: app.step(-(10**9)),
    "end": lambda app, shift: app.step(10**9),
    "z": lambda app, shift: redo(app) if shift else undo(app),
    "f": lambda app, shift: app.frame_face(),
    "v": _next_pair,
    "w": lambda app, shift: _toggle("wireframe", "faces", "panel")(app, None),
    "l": lambda app, shift: _link(app),
    "escape": _escape,
}

_COMMANDS: dict[str, Callable[[Any, Any], None]] = {
    "mode": lambda app, name: app.choose_mode(str(name)),
    "pair": lambda app, name: app.choose_pair(str(name)),
    "map": _map,
    "frame": lambda app, frame: app.go_to_frame(int(frame)),
    "play": _play,
    "loop": _loop,
    "speed": _speed,
    "step": lambda app, count: app.step(int(count)),
    "window": _window,
    "basis": _basis,
    "linked": _link,
    "wireframe": _toggle("wireframe", "faces", "panel"),
    "frame_face": lambda app, _: app.frame_face(),
    "view": _view,
    "help": _toggle("help_shown", "panel", "overlay"),
    "undo": undo,
    "redo": redo,
    "run": _run_stages,
    "cancel": _cancel,
    "check": _check,
    "quit": _quit,
}
