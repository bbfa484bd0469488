"""What the window says about the application: panel, time line, status line, colour maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolkit.checks.picks import NEEDED_LANDMARKS
from viewer.help_card import Group
from viewer.state.fields import MAPS
from viewer.state.panes import PAIRS
from viewer.state.rows import Button, Buttons, Choice, Heading, Note, Row, Slider
from viewer.timeline import Timeline

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["help_groups", "panel_rows", "status_line", "timeline_of"]

_MODES_IN_A_ROW = 4


def panel_rows(app: App) -> list[Row]:
    """Modes, the mode's own rows, what to do next, and how things are shown."""
    rows: list[Row] = []
    buttons = [
        Button(f"mode:{name}", f"{index} {mode.title}", on=mode is app.mode)
        for index, (name, mode) in enumerate(app.modes.items(), start=1)
    ]
    for start in range(0, len(buttons), _MODES_IN_A_ROW):
        rows.append(Buttons(tuple(buttons[start : start + _MODES_IN_A_ROW])))
    rows += _next_rows(app)
    rows.append(Heading(app.mode.title))
    rows += app.mode.rows()
    rows += _view_rows(app)
    return rows


def _next_rows(app: App) -> list[Row]:
    """What to do next, as long as something is."""
    steps, idle = app.steps, app.worker.progress is None
    if steps is None:
        return [Note("looking at the shot ...", "quiet")]
    if steps.problem:
        return [Heading("To mend"), Note(steps.problem, "bad"), Button("check", "Look again", idle)]
    if not steps.open:
        return []
    if steps.open == ("result",):
        return [
            Note("The files in result/ are without the last edits; exporting brings them up to date too.", "quiet"),
            Button("run:all", "Bring them up to date", idle),
        ]
    words = advice(app)
    rows: list[Row] = [Heading("Next"), Note(words, "plain")]
    if not steps.done("register") and app.mode.name != "landmarks":
        rows.append(Button("run:register", "Register", idle))
    rows.append(Button("run:all", "Run all steps that are to do", idle))
    return rows


def advice(app: App) -> str:
    """What a user with this shot should do next, in a sentence."""
    steps = app.steps
    if steps is None or not steps.open:
        return ""
    if steps.states["register"] != "done":
        count = getattr(app.modes.get("landmarks"), "count", 0)
        if steps.states["register"] == "missing":
            if count < NEEDED_LANDMARKS:
                return f"Pick landmarks on both faces: {count} so far, 40 to 50 are best. Then register."
            return f"{count} landmarks are there. Register, and look at the distance."
        return "Landmarks, lines or files changed since the registration: register again."
    if steps.states["decompose"] == "missing":
        return "The target is registered. If the distance looks right, run the rest."
    names = [line for line in steps.lines() if not line.endswith("done")]
    return "; ".join(names).capitalize() + "."


def _view_rows(app: App) -> list[Row]:
    pairs = tuple((pair.name, pair.words) for pair in PAIRS.values() if app.can_show(pair))
    rows: list[Row] = [Heading("View"), Choice("pair", "show", pairs, app.pair.name)]
    maps = tuple(entry for entry in MAPS if app.maps.possible(entry[0]))
    rows.append(Choice("map", "colours", maps, app.map))
    rows.append(
        Buttons(
            (
                Button("linked", "Link", on=app.linked),
                Button("wireframe", "Wires", on=app.wireframe),
                Button("frame_face", "Frame"),
                Button("help", "Keys (?)", on=app.help_shown),
            )
        )
    )
    rows.append(Slider("light:azimuth", "light, degrees", app.light.azimuth, -180, 180, whole=True))
    rows.append(Slider("light:elevation", "its height", app.light.elevation, -89, 89, whole=True))
    rows.append(Slider("light:raking", "its hardness", app.light.raking, 0, 1))
    if app.data.has_bases:
        n_bases = app.data.weights.shape[1]
        options = tuple((str(k), f"basis {k + 1}") for k in range(n_bases))
        rows.append(Choice("basis", "curve of", options, str(app.basis)))
    return rows


def status_line(app: App) -> tuple[str, str]:
    """What is going on, what a click will do, how long the last solve took."""
    progress = app.worker.progress  # once: the worker goes on meanwhile
    if progress is not None:
        what, done, total = progress
        share = f" {done} of {total}" if total else ""
        return f"{what}{share} ... (Esc cancels)", "plain"
    words = [app.message] if app.message else []
    words.append(app.mode.hint())
    if app.solve_seconds is not None:
        words.append(f"last solve {app.solve_seconds:.2f} s")
    return "   |   ".join(words), app.tone if app.message else "plain"


def timeline_of(app: App) -> Timeline:
    """Frame, window, marks and the chosen basis's curves."""
    shown = app.editing.snapshot
    source = edited = None
    title = "no bases are chosen yet; their weights over the take will be here"
    if shown is not None:
        app.basis = min(app.basis, shown.weights.shape[1] - 1)
        source = shown.weights[:, app.basis]
        edited = shown.edited_weights[:, app.basis]
        if np.array_equal(source, edited):
            edited = None
    elif app.data.has_bases:
        app.basis = min(app.basis, app.data.weights.shape[1] - 1)
        source = app.data.weights[:, app.basis]
    if source is not None:
        title = f"basis {app.basis + 1}: weight of the source" + (
            " (grey), edited (orange)" if edited is not None else ""
        )
    return Timeline(
        app.play.frame,
        app.play.fps,
        app.play.window,
        app.editing.moved_share(),
        source,
        edited,
        title,
        app.mode.key_frames(),
        app.mode.gain_curve(),
    )


def help_groups(app: App) -> list[Group]:
    """Every key and what it does; those of the present mode first."""
    own = [Group(app.mode.title, app.mode.keys())] if app.mode.keys() else []
    modes = (f"1 to {len(app.modes)}", "the modes, as they are numbered")
    return [*own, Group("Pointer", _POINTER), Group("Everywhere", (modes, *_KEYS))]


_POINTER = (
    ("left drag", "turn the view; with alt in every tool"),
    ("right drag, wheel", "pan, zoom"),
    ("ctrl-right drag", "turn the light"),
)
_KEYS = (
    ("space", "play or pause"),
    ("left, right", "a frame back or on (shift: ten)"),
    ("home, end", "first or last frame"),
    ("z, shift-z", "undo, redo"),
    ("f", "frame the face"),
    ("v, shift-v", "next or last pair of views"),
    ("w", "wireframe"),
    ("l", "link the views, or not"),
    ("esc", "cancel what is running, or close this"),
    ("ctrl-q", "quit"),
    ("?", "these keys"),
)
