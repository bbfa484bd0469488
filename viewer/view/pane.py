"""One pane: a face, its wires, marks and numbers, seen through our own camera; events of the mouse as ours."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from toolkit.rendering.camera import triple
from viewer import overlay, shading
from viewer.layout import Rectangle
from viewer.state.app import App
from viewer.state.cameras import pixel_ray
from viewer.state.events import Pointer
from viewer.state.marks import YELLOW, Disc, Text
from viewer.view import open3d_calls as native
from viewer.view.open3d_calls import DynamicMesh, gui
from viewer.view.wires import Wires

__all__ = ["Pane"]

_IVORY = np.array([[0.86, 0.85, 0.82]], np.float32)
_LABELS = 96
_LABEL_ROOM = (20.0, 13.0)
"""Width and height, on a plain screen, within which there is one number only."""
_USUAL_MARKS = 4096
"""Triangles of marks that are made room for at once: a mesh that replaces a smaller one costs a blink of the window."""


class Pane:
    """Draws one of the two panes of `App`.

    Parameters
    ----------
    send : takes the events
    """

    def __init__(self, window: Any, app: App, index: int, send: Callable[[Pointer], None]) -> None:
        self.app, self.index, self._send = app, index, send
        self.widget, self.scene = native.new_scene(window)
        self._face: DynamicMesh | None = None
        self._triangles: Any = None
        self._normals = np.zeros((0, 3), np.float32)
        self._wires: Wires | None = None
        self._extras: DynamicMesh | None = None
        self._extra_triangles: Any = None
        self._overlay: DynamicMesh | None = None
        self._capacity = 0
        self._labels: list[Any] = []
        self._pressed: tuple[str, float, float] | None = None
        self._last = (0.0, 0.0)
        self._travel = 0.0

    # -- drawing --------------------------------------------------------------------------------------------------

    def place(self, frame: Rectangle) -> None:
        """Put the pane into a rectangle of the window."""
        self.widget.frame = native.rectangle(frame)
        self.app.pane_sizes[self.index] = frame.size

    def draw_camera(self) -> None:
        """Look from where the application says."""
        native.set_camera(self.widget, self.app.framing_camera(self.index))

    def draw_face(self) -> None:
        """Positions and lit colours of the present frame."""
        app = self.app
        surface, camera = app.surface(self.index), app.framing_camera(self.index)
        if self._face is None or self._triangles is not surface.triangles:
            self._replace_face(surface.triangles, len(surface.vertices))
        assert self._face is not None
        positions, colors = self._face.next_buffers()
        positions[:] = surface.vertices
        shading.bake(
            positions,
            surface.triangles,
            app.base_colors(self.index),
            app.light,
            camera,
            self._normals,
            colors,
            soft=app.field(self.index) is not None,
        )
        self._face.show()
        self._draw_wires(positions, camera)
        self._draw_extras(camera)
        self.widget.force_redraw()

    def draw_overlay(self) -> None:
        """Marks and numbers."""
        app = self.app
        camera, marks = app.framing_camera(self.index), app.marks(self.index)
        corners, colors = overlay.build(marks, camera, app.plain_height(self.index))
        if len(corners) > self._capacity or self._overlay is None:
            if self._overlay is not None:
                self._overlay.remove()
            triangles = max(_USUAL_MARKS, 2 * len(corners) // overlay.CORNERS)
            self._capacity = triangles * overlay.CORNERS
            self._overlay = self._mesh(f"overlay {self._capacity}", overlay.triangles_for(triangles), self._capacity)
        to_positions, to_colors = self._overlay.next_buffers()
        to_positions[: len(corners)], to_colors[: len(corners)] = corners, colors
        to_positions[len(corners) :] = _hidden(camera)
        self._overlay.show()
        self._draw_labels(marks)
        self.widget.force_redraw()

    def _mesh(self, name: str, triangles: Any, n_vertices: int) -> DynamicMesh:
        return DynamicMesh(self.scene, name, triangles, n_vertices)

    def _replace_face(self, triangles: Any, n_vertices: int) -> None:
        if self._face is not None:
            self._face.remove()
        self._face = self._mesh("face", triangles, n_vertices)
        self._triangles = triangles
        self._normals = np.zeros((n_vertices, 3), np.float32)

    def _draw_extras(self, camera: Any) -> None:
        """Eyeballs and the like, of their own colour."""
        found = self.app.extras(self.index)
        if self._extras is not None and (found is None or self._extra_triangles is not found[1]):
            self._extras.remove()
            self._extras = None
        if found is None:
            return
        if self._extras is None:
            self._extras = self._mesh("extras", found[1], len(found[0]))
            self._extra_triangles = found[1]
        positions, colors = self._extras.next_buffers()
        positions[:] = found[0]
        shading.bake(positions, found[1], _IVORY, self.app.light, camera, np.empty_like(positions), colors)
        self._extras.show()

    def _draw_wires(self, positions: Any, camera: Any) -> None:
        edges = self.app.edges(self.index) if self.app.wireframe else None
        if self._wires is not None and self._wires.edges is not edges:
            self._wires.remove()
            self._wires = None
        if edges is None:
            return
        if self._wires is None:
            self._wires = Wires(self.scene, edges)
        self._wires.draw(positions, camera, self.app.plain_height(self.index))
        if not self._wires.whole:
            self.app.touch("faces")

    def _draw_labels(self, marks: Any) -> None:
        """Numbers beside discs, of those that the face does not hide and that find room, the chosen one's first."""
        app = self.app
        wanted = [mark for mark in marks if (isinstance(mark, Disc | Text)) and mark.text]
        wanted.sort(key=lambda mark: mark.color != YELLOW)
        if wanted:
            camera = app.framing_camera(self.index)
            places = np.array([mark.position for mark in wanted])
            seen = app.picker(self.index).sees(places, camera) if not app.play.playing else np.ones(len(wanted), bool)
            wanted = [mark for mark, shown in zip(wanted, seen, strict=True) if shown]
            pixels = camera.project(places[seen], app.pane_sizes[self.index])[:, :2]
            room = np.multiply(_LABEL_ROOM, app.density)
            wanted = [wanted[k] for k in overlay.uncrowded(pixels, *room)[:_LABELS]]
        while len(self._labels) < len(wanted):
            self._labels.append(self.widget.add_3d_label(np.zeros(3, np.float32), ""))
        for label, mark in zip(self._labels, wanted, strict=False):
            label.position = np.asarray(mark.position, np.float32)
            label.text = " " + mark.text
            label.color = gui.Color(1.0, 1.0, 1.0)
        for label in self._labels[len(wanted) :]:
            label.text = ""

    # -- events ---------------------------------------------------------------------------------------------------

    def mouse(self, event: Any) -> Any:
        """An event of the mouse over the pane; every one is used up here: the camera is ours too."""
        # Events are in the window's coordinates, whatever the widget: the right pane is the one that would suffer.
        x, y = float(event.x - self.widget.frame.x), float(event.y - self.widget.frame.y)
        kinds = gui.MouseEvent.Type
        if event.type == kinds.BUTTON_DOWN and self._pressed is None:
            self._pressed, self._last, self._travel = (native.button_of(event), x, y), (x, y), 0.0
            self._emit("press", event, x, y, True)
        elif event.type == kinds.DRAG and self._pressed is not None:
            self._emit("drag", event, x, y, self.app.mode.hits_in_drag)
        elif event.type == kinds.BUTTON_UP and self._pressed is not None:
            self._emit("release", event, x, y, self.app.mode.hits_in_drag or self._pressed[0] == "left")
            self._pressed = None
        elif event.type == kinds.WHEEL:
            self._emit("wheel", event, x, y, False)
        elif event.type == kinds.MOVE and self.app.mode.hovers:
            self._emit("hover", event, x, y, True)
        return gui.Widget.EventCallbackResult.CONSUMED

    def _emit(self, kind: str, event: Any, x: float, y: float, with_hit: bool) -> None:
        width, height = self.app.pane_sizes[self.index]
        # A pixel is meant by its centre.
        x, y = x + 0.5, y + 0.5
        origin, direction = pixel_ray(self.app.framing_camera(self.index), x, y, (width, height))
        moved = ((x - 0.5 - self._last[0]) / height, (self._last[1] - y + 0.5) / height)
        self._last = (x - 0.5, y - 0.5)
        self._travel += float(np.hypot(*moved))
        if self.app.play.playing and kind in ("drag", "hover"):
            with_hit = False
        pointer = Pointer(
            kind,
            self.index,
            self._pressed[0] if self._pressed else "none",
            native.modifiers_of(event),
            triple(origin),
            triple(direction),
            self.app.pick(self.index, x, y) if with_hit else None,
            moved if kind in ("drag", "release") else (0.0, 0.0),
            self._travel,
            float(event.wheel_dy) if kind == "wheel" else 0.0,
        )
        self._send(pointer)


def _hidden(camera: Any) -> Any:
    """A place behind the camera, where unused triangles collapse."""
    position, target = np.asarray(camera.position), np.asarray(camera.target)
    return (position + (position - target)).astype(np.float32)
