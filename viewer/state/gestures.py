"""What the pointer does where the mode leaves it alone: turn, pan, zoom, move the light; and who gets a drag."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from viewer.state.events import Pointer

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["CLICK", "Gestures"]

CLICK = 0.006
"""A press that travels less than this share of the pane's height is a click."""


class Gestures:
    """Hands pointer events to the mode, or turns the view by them."""

    def __init__(self, app: App) -> None:
        self._app = app
        self._capture = ""

    def handle(self, event: Pointer) -> None:
        """One event."""
        mode = self._app.mode
        if event.kind == "wheel":
            if not mode.wheel(event):
                view = self._app.view_of(event.pane)
                self._app.set_view(event.pane, view.zoomed(event.wheel, self._under(event)))
        elif event.kind == "hover":
            mode.hover(event)
        elif event.kind == "press":
            self._app.catch_up()
            kept = event.button == "left" and "alt" not in event.modifiers and mode.press(event)
            self._capture = "mode" if kept else _gesture(event)
        elif event.kind == "drag":
            self._drag(event)
        elif event.kind == "release":
            captured, self._capture = self._capture, ""
            if captured == "mode":
                mode.release(event)
            elif event.button == "left" and event.travel <= CLICK:
                mode.click(event)

    def _drag(self, event: Pointer) -> None:
        view = self._app.view_of(event.pane)
        if self._capture == "mode":
            self._app.mode.drag(event)
        elif self._capture == "orbit":
            self._app.set_view(event.pane, view.orbited(*event.moved))
        elif self._capture == "pan":
            self._app.set_view(event.pane, view.panned(*event.moved))
        elif self._capture == "light":
            self._turn_light(*event.moved)

    def _turn_light(self, right: float, up: float) -> None:
        light = self._app.light
        azimuth, elevation = light.azimuth + 180 * right, light.elevation + 180 * up
        self._app.light = replace(
            light,
            azimuth=float((azimuth + 180) % 360 - 180),
            elevation=float(np.clip(elevation, -89, 89)),
        )
        self._app.touch("faces", "panel")

    def _under(self, event: Pointer) -> NDArray[np.float64]:
        """What the pointer is over, in the plane through what is looked at: from the face's centre, in its heights."""
        framing, camera = self._app.surface(event.pane).framing, self._app.framing_camera(event.pane)
        toward = camera.axes()[2]
        origin, direction = np.asarray(event.origin), np.asarray(event.direction)
        reach = float((np.asarray(camera.target) - origin) @ toward) / min(float(direction @ toward), -1e-6)
        place = origin + reach * direction
        return np.asarray((place - np.asarray(framing.centre)) @ np.asarray(framing.axes).T / framing.height)


def _gesture(event: Pointer) -> str:
    """What a drag does that the mode left alone."""
    if event.button == "middle" or (event.button == "right" and "ctrl" not in event.modifiers):
        return "pan"
    if event.button == "right":
        return "light"
    return "pan" if "ctrl" in event.modifiers else "orbit"
