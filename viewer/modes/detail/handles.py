"""The handles of a paste: a ring round its goal, whose knob turns and scales it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit import SurfacePoint
from viewer.modes.shared.pointing import on_plane, surface_places
from viewer.state.events import Pointer

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["PasteRing"]

Array = NDArray[np.float64]

_SIDES = 48


@dataclass(frozen=True)
class PasteRing:
    """``middle`` (3,), unit ``normal``, ``up`` and ``side`` of the goal's tangent plane, ``radius`` at scale 1.

    Seen from outside, ``side`` lies a quarter turn counter-clockwise of ``up``: so an edit's rotation counts.
    """

    middle: Array
    up: Array
    side: Array
    normal: Array
    radius: float

    @classmethod
    def at(cls, app: App, pane: int, goal: SurfacePoint, radius: float) -> PasteRing:
        """On a pane's face."""
        middle = surface_places(app, pane, [goal.triangle], [goal.weights])[0]
        normal = app.picker(pane).normal(goal.triangle)
        above = np.asarray(app.surface(pane).framing.axes[1])
        up = above - (above @ normal) * normal
        up /= max(float(np.linalg.norm(up)), 1e-9)
        return cls(middle, up, np.cross(normal, up), normal, radius)

    def knob(self, rotation: float, scale: float) -> Array:
        """Where the knob is, ``(3,)``."""
        angle = np.radians(rotation)
        return np.asarray(self.middle + scale * self.radius * (np.cos(angle) * self.up + np.sin(angle) * self.side))

    def turned(self, event: Pointer) -> tuple[float, float] | None:
        """Rotation in degrees and scale that bring the knob under the pointer."""
        place = on_plane(event, self.middle, self.normal)
        if place is None:
            return None
        x, y = float((place - self.middle) @ self.up), float((place - self.middle) @ self.side)
        scale = float(np.clip(np.hypot(x, y) / self.radius, 0.2, 5.0))
        return float(np.degrees(np.arctan2(y, x))), scale

    def circle(self, scale: float) -> Array:
        """The ring, ``(n, 3)``."""
        angle = np.linspace(0, 2 * np.pi, _SIDES, endpoint=False)
        around = np.cos(angle)[:, None] * self.up + np.sin(angle)[:, None] * self.side
        return np.asarray(self.middle + scale * self.radius * around)
