"""Events as JSON lines: recorded while the viewer runs, and replayed, to reproduce what went wrong.

A line is an event (`viewer.state.events`) or one of the player's own: ``{"wait": seconds}`` and
``{"screenshot": path}`` (both panes). A pointer event may name a ``vertex`` in place of the ray and the hit.
"""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from toolkit.errors import InputError
from viewer.state.events import Event, Pointer, event_from, event_to

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["Player", "Recorder", "point_at"]


class Recorder:
    """Writes every event to a file, flushed, so that a crash leaves what led to it."""

    def __init__(self, path: Path) -> None:
        self._file: IO[str] = path.open("w", encoding="utf-8")

    def write(self, event: Event) -> None:
        """One line."""
        if isinstance(event, Pointer) and event.kind == "hover":
            return
        self._file.write(json.dumps(event_to(event)) + "\n")
        self._file.flush()


class Player:
    """Sends the lines of a script, one a tick, each when long work is done."""

    def __init__(self, path: Path) -> None:
        self._lines: deque[tuple[int, dict[str, Any]]] = deque()
        self._until = 0.0
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            if line.strip() and not line.lstrip().startswith("#"):
                try:
                    self._lines.append((number, json.loads(line)))
                except ValueError as error:
                    raise InputError(f"line {number} is no JSON ({error})", where=path, remedy="mend it") from error
        self._path = path

    @property
    def finished(self) -> bool:
        """Whether every line was sent."""
        return not self._lines

    def play(self, send: Callable[[Event], None], app: App, window: Any = None) -> None:
        """Send the next line if it is its turn."""
        if not self._lines or time.monotonic() < self._until:
            return
        number, line = self._lines[0]
        waits = not (line.get("event") == "command" and line.get("name") == "cancel")
        if waits and app.busy:
            return
        self._lines.popleft()
        if "wait" in line:
            self._until = time.monotonic() + float(line["wait"])
        elif "screenshot" in line:
            if window is not None:
                window.screenshot(Path(line["screenshot"]))
        else:
            try:
                send(event_from(_with_vertex(line, app)))
            except InputError as error:
                raise InputError(error.what, where=f"{self._path}, line {number}", remedy=error.remedy) from error


def point_at(app: App, pane: int, vertex: int) -> dict[str, Any]:
    """Ray and hit of a pointer event at a vertex of the face in a pane."""
    position = np.asarray(app.surface(pane).vertices[vertex], dtype=np.float64)
    origin = np.asarray(app.framing_camera(pane).position)
    direction = (position - origin) / np.linalg.norm(position - origin)
    triangles = app.surface(pane).triangles
    triangle = int(np.argmax((triangles == vertex).any(axis=1)))
    barycentric = (triangles[triangle] == vertex).astype(float)
    hit = {
        "triangle": triangle,
        "barycentric": barycentric.tolist(),
        "vertex": int(vertex),
        "position": position.tolist(),
    }
    return {"origin": origin.tolist(), "direction": direction.tolist(), "hit": hit}


def _with_vertex(line: dict[str, Any], app: App) -> dict[str, Any]:
    if line.get("event") != "pointer" or "vertex" not in line:
        return line
    values = dict(line)
    vertex = int(values.pop("vertex"))
    return {**values, **point_at(app, int(values.get("pane", 0)), vertex)}
