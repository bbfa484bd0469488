"""Every call whose form or behaviour depends on the version of Open3D, in one place (0.19 OpenGL, 0.20 Vulkan)."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from open3d.visualization import gui, rendering

from toolkit.rendering import Camera
from viewer.layout import Rectangle

__all__ = [
    "DynamicMesh",
    "gui",
    "image_of",
    "image_widget",
    "key_name",
    "lowered",
    "modifiers_of",
    "new_scene",
    "quit_later",
    "rectangle",
    "set_camera",
]

_RING = 3
"""Buffers in turn: Open3D reads the arrays after the call, in its own thread, and takes no copy."""

_LINGER = 10.0
"""Seconds for which buffers outlive their mesh: that thread may not have come to them when the mesh is removed."""


class DynamicMesh:
    """A mesh in a scene whose positions and colours are replaced, never the mesh: each adding leaks, and 65,536 kill.

    Parameters
    ----------
    scene : the rendering Scene
    name : its name there
    triangles : (F, 3) of ``n_vertices``
    """

    _removed: ClassVar[deque[tuple[float, DynamicMesh]]] = deque()

    def __init__(
        self,
        scene: Any,
        name: str,
        triangles: NDArray[np.int32],
        n_vertices: int,
    ) -> None:
        self._scene, self.name = scene, name
        self.positions = [np.zeros((n_vertices, 3), np.float32) for _ in range(_RING)]
        self.colors = [np.zeros((n_vertices, 3), np.float32) for _ in range(_RING)]
        # A bounding box without a volume is refused, with the end of the process.
        self.positions[0][:2] = [[-1, -1, -1], [1, 1, 1]]
        self._clouds = [_cloud(p, c) for p, c in zip(self.positions, self.colors, strict=True)]
        self._turn = 0
        self._mesh = _geometry(self.positions[0], self.colors[0], triangles)
        material = rendering.MaterialRecord()
        material.shader = "defaultUnlit"
        scene.add_geometry(name, self._mesh, material)
        # The bounding box is that of the first shape, so nothing may be left out by it.
        scene.set_geometry_culling(name, False)

    def next_buffers(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Positions and colours (V, 3) to fill before `show`."""
        self._turn = (self._turn + 1) % _RING
        return self.positions[self._turn], self.colors[self._turn]

    def show(self) -> None:
        """Show what `next_buffers` was filled with."""
        flags = rendering.Scene.UPDATE_POINTS_FLAG | rendering.Scene.UPDATE_COLORS_FLAG
        self._scene.update_geometry(self.name, self._clouds[self._turn], flags)

    def remove(self) -> None:
        """Take it out of the scene."""
        self._scene.remove_geometry(self.name)
        now = time.monotonic()
        while self._removed and self._removed[0][0] < now - _LINGER:
            self._removed.popleft()
        self._removed.append((now, self))


def new_scene(window: Any) -> tuple[Any, Any]:
    """A SceneWidget with an empty scene, unlit, colours shown as they are."""
    widget = gui.SceneWidget()
    widget.scene = rendering.Open3DScene(window.renderer)
    widget.scene.set_background([0.36, 0.37, 0.39, 1.0])  # decoded, but not encoded again: about 0.1
    widget.scene.view.set_sample_count(4)
    # Without it there are no tone curves between our colours and the screen.
    widget.scene.view.set_post_processing(False)
    widget.scene.view.set_shadowing(False, rendering.View.ShadowType.PCF)
    widget.scene.set_lighting(rendering.Open3DScene.LightingProfile.NO_SHADOWS, np.array([0.0, 0.0, -1.0], np.float32))
    widget.scene.scene.enable_sun_light(False)
    widget.enable_scene_caching(True)
    return widget, widget.scene.scene


def set_camera(widget: Any, camera: Camera) -> None:
    """Look through ``camera``; ``widget.frame`` says how wide it is."""
    frame = widget.frame
    if frame.width < 1 or frame.height < 1:
        return
    native = widget.scene.camera
    near, far = 0.05 * camera.distance, 30.0 * camera.distance
    vertical = rendering.Camera.FovType.Vertical
    native.set_projection(camera.fov, frame.width / frame.height, near, far, vertical)
    target, position, up = (np.asarray(v, dtype=np.float32) for v in (camera.target, camera.position, camera.up))
    native.look_at(target, position, up)
    widget.force_redraw()


def rectangle(place: Rectangle) -> Any:
    """A place as Open3D has it."""
    return gui.Rect(place.x, place.y, place.width, place.height)


def image_of(pixels: NDArray[np.uint8]) -> Any:
    """A picture for an ImageWidget."""
    return o3d.geometry.Image(np.ascontiguousarray(pixels))


def image_widget() -> Any:
    """A widget for pictures; Open3D's own, without one, is a red box that tells of an error."""
    return gui.ImageWidget(image_of(np.zeros((1, 1, 3), np.uint8)))


def lowered(widget: Any, above: float, below: float = 0.0) -> Any:
    """The widget with room above: layouts put all at the top of a row, where words stand higher than those in boxes."""
    column = gui.Vert(0, gui.Margins(0, round(above), 0, round(below)))
    column.add_child(widget)
    return column


def quit_later(app: Any, window: Any) -> None:
    """End the application; from inside a callback only the main loop may do it (both versions crash otherwise)."""
    app.post_to_main_thread(window, app.quit)


def save_scene(scene: Any, done: Callable[[NDArray[np.uint8]], None]) -> None:
    """Render a scene off-screen; ``done(pixels)`` comes later, from the main loop."""
    scene.render_to_image(lambda image: done(np.array(np.asarray(image))))


_NAMED = {
    "SPACE": "space",
    "LEFT": "left",
    "RIGHT": "right",
    "UP": "up",
    "DOWN": "down",
    "HOME": "home",
    "END": "end",
    "ESCAPE": "escape",
    "ENTER": "enter",
    "DELETE": "delete",
    "BACKSPACE": "backspace",
    "TAB": "tab",
    "SLASH": "/",
    "QUESTION_MARK": "?",
    "LEFT_BRACKET": "[",
    "RIGHT_BRACKET": "]",
    "MINUS": "-",
    "EQUALS": "=",
    "PLUS": "+",
    "COMMA": ",",
    "PERIOD": ".",
}
_DIGITS = ("ZERO", "ONE", "TWO", "THREE", "FOUR", "FIVE", "SIX", "SEVEN", "EIGHT", "NINE")
_HELD = {"LEFT_SHIFT": "shift", "RIGHT_SHIFT": "shift", "LEFT_CONTROL": "ctrl", "RIGHT_CONTROL": "ctrl", "ALT": "alt"}


def _key_table() -> dict[int, str]:
    table = {int(getattr(gui.KeyName, native).value): name for native, name in _NAMED.items()}
    table |= {int(getattr(gui.KeyName, native).value): str(digit) for digit, native in enumerate(_DIGITS)}
    table |= {int(getattr(gui.KeyName, chr(code)).value): chr(code).lower() for code in range(ord("A"), ord("Z") + 1)}
    return table


_KEYS = _key_table()
_HELD_KEYS = {int(getattr(gui.KeyName, native).value): name for native, name in _HELD.items()}


def key_name(event: Any) -> str | None:
    """Our name of a key event's key; None for keys that mean nothing here."""
    return _KEYS.get(int(event.key))


def held_name(event: Any) -> str | None:
    """Which modifier a key event's key is; key events do not carry modifiers."""
    return _HELD_KEYS.get(int(event.key))


def modifiers_of(event: Any) -> tuple[str, ...]:
    """Modifiers that are held down in a mouse event."""
    named = (("shift", gui.KeyModifier.SHIFT), ("ctrl", gui.KeyModifier.CTRL), ("alt", gui.KeyModifier.ALT))
    return tuple(name for name, native in named if event.is_modifier_down(native))


def button_of(event: Any) -> str:
    """The mouse button of an event, or "none"."""
    named = (("left", gui.MouseButton.LEFT), ("right", gui.MouseButton.RIGHT), ("middle", gui.MouseButton.MIDDLE))
    return next((name for name, native in named if event.is_button_down(native)), "none")


def _cloud(positions: NDArray[np.float32], colors: NDArray[np.float32]) -> Any:
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor.from_numpy(positions))
    cloud.point.colors = o3d.core.Tensor.from_numpy(colors)
    return cloud


def _geometry(
    positions: NDArray[np.float32],
    colors: NDArray[np.float32],
    triangles: NDArray[np.int32],
) -> Any:
    # A line set cannot be updated so (an unknown exception ends the process), hence ribbons for curves and wires.
    mesh = o3d.t.geometry.TriangleMesh()  # without triangle attributes: they crash the update
    mesh.vertex.positions = o3d.core.Tensor.from_numpy(positions)
    mesh.vertex.colors = o3d.core.Tensor.from_numpy(colors)
    mesh.triangle.indices = o3d.core.Tensor(np.ascontiguousarray(triangles, dtype=np.int32))
    return mesh
