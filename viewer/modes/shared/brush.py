"""A soft round brush: where it touches while the pointer moves, how large it is, and its ring on the face."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from toolkit.detail_edit import Dab, SurfacePoint
from viewer.modes.shared.ground import Ground
from viewer.picking import Picker
from viewer.state.events import Hit, Pointer
from viewer.state.marks import WHITE, Curve

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["LARGEST", "SMALLEST", "Brush"]

SMALLEST, LARGEST = 0.004, 0.3
_STEP = 0.35  # touches of a stroke lie this share of the radius apart
_MOST_TOUCHES = 24
_RING = 40


@dataclass
class Brush:
    """``radius`` as a share of the face's height, ``hardness`` 0 soft to 1 hard."""

    radius: float = 0.035
    hardness: float = 0.4

    def turned(self, notches: float) -> None:
        """Larger by notches of the wheel."""
        self.radius = float(np.clip(self.radius * 1.12**notches, SMALLEST, LARGEST))

    def dabs(
        self, app: App, ground: Ground, last: Pointer | None, event: Pointer, erase: bool, picker: Picker
    ) -> list[Dab]:
        """The touches from the last event to this one, none where the pointer is beside the face."""
        radius = self.radius * app.surface(event.pane).framing.height / ground.scale
        return [
            Dab(SurfacePoint(hit.triangle, hit.barycentric), radius, hardness=self.hardness, erase=erase)
            for hit in stroke(picker, last, event, _STEP * self.radius * app.surface(event.pane).framing.height)
        ]

    def ring(self, app: App, pane: int, hit: Hit, picker: Picker | None = None) -> Curve:
        """The brush's rim, laid on the face as the camera sees it, or on the one that ``picker`` knows."""
        camera = app.framing_camera(pane)
        radius = self.radius * app.surface(pane).framing.height
        right, above, _ = camera.axes()
        angle = np.linspace(0, 2 * np.pi, _RING, endpoint=False)
        rim = np.asarray(hit.position) + radius * (np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * above)
        return Curve((picker or app.picker(pane)).draped(camera.position, rim, 2 * radius), WHITE, 1.6, closed=True)


def stroke(picker: Picker, last: Pointer | None, event: Pointer, spacing: float) -> list[Hit]:
    """Hits between two events of a drag, no farther apart than ``spacing``, in the face's unit."""
    if event.hit is None:
        return []
    if last is None or last.hit is None or last.pane != event.pane:
        return [event.hit]
    gap = float(np.linalg.norm(np.subtract(event.hit.position, last.hit.position)))
    count = int(np.clip(np.ceil(gap / max(spacing, 1e-9)), 1, _MOST_TOUCHES))
    if count == 1:
        return [event.hit]
    start, end = np.asarray(last.direction), np.asarray(event.direction)
    shares = (np.arange(1, count) / count)[:, None]
    directions = (1 - shares) * start + shares * end
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return [*picker.along_all(event.origin, directions), event.hit]
