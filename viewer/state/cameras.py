"""The view as the user turns it: relative to the face, so that linked panes agree whatever their unit and place.

`Framing` says where a face is (centre, height, axes); `Viewpoint` where it is looked at from, in its heights; both
together give a `toolkit.rendering.Camera`, which knows nothing of the window either.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from toolkit.rendering.camera import Camera, triple
from toolkit.rigid import Similarity

__all__ = ["FIELD_OF_VIEW", "Framing", "Viewpoint", "pixel_ray", "pixel_size"]

Array = NDArray[np.float64]

FIELD_OF_VIEW = 22.0
_STEEPEST = 85.0
_NEAREST, _FARTHEST = 0.15, 30.0


@dataclass(frozen=True)
class Framing:
    """Where a face is: ``centre`` (3,), ``height`` in its unit, ``axes`` (3, 3): rows right, up, out of the face."""

    centre: tuple[float, float, float]
    height: float
    axes: tuple[tuple[float, float, float], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    @classmethod
    def of(cls, vertices: ArrayLike) -> Framing:
        """Round all of ``vertices`` (V, 3), which look along +z with y up."""
        points = np.asarray(vertices, dtype=np.float64)
        low, high = points.min(axis=0), points.max(axis=0)
        height = max(float(high[1] - low[1]), 0.8 * float(high[0] - low[0]), 1e-9)
        return cls(triple((low + high) / 2), height)

    def moved(self, pose: Similarity) -> Framing:
        """The same framing on a face that lies elsewhere, is turned, and has another size."""
        axes = np.asarray(self.axes) @ pose.rotation.T
        centre = pose.apply(np.asarray(self.centre)[None])[0]
        return Framing(triple(centre), self.height * pose.scale, tuple(triple(axis) for axis in axes))


@dataclass(frozen=True)
class Viewpoint:
    """From where a face is looked at.

    Turned by ``azimuth`` (to the picture's right) and ``elevation`` in degrees, ``distance`` and ``shift`` in face
    heights. ``shift`` moves what is looked at, along the face's axes.
    """

    azimuth: float = 0.0
    elevation: float = 0.0
    distance: float = 3.0
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def camera(self, framing: Framing) -> Camera:
        """The camera that sees ``framing`` from here."""
        axes = np.asarray(framing.axes)
        toward = self._toward() @ axes
        target = np.asarray(framing.centre) + framing.height * (np.asarray(self.shift) @ axes)
        position = target + self.distance * framing.height * toward
        return Camera(triple(position), triple(target), triple(axes[1]), FIELD_OF_VIEW)

    def orbited(self, right: float, up: float) -> Viewpoint:
        """Turned by a drag of that many pane heights."""
        elevation = float(np.clip(self.elevation - 150 * up, -_STEEPEST, _STEEPEST))
        return replace(self, azimuth=(self.azimuth - 150 * right + 180) % 360 - 180, elevation=elevation)

    def panned(self, right: float, up: float) -> Viewpoint:
        """Shifted so that the face follows a drag of that many pane heights."""
        across = 2 * np.tan(np.radians(FIELD_OF_VIEW) / 2) * self.distance
        toward = self._toward()
        side = np.array([toward[2], 0.0, -toward[0]]) / max(float(np.hypot(toward[0], toward[2])), 1e-9)
        above = np.cross(toward, side)
        return replace(self, shift=triple(np.asarray(self.shift) - across * (right * side + up * above)))

    def zoomed(self, notches: float, about: ArrayLike | None = None) -> Viewpoint:
        """Closer by some notches of the wheel; ``about`` (3,), as ``shift`` is, keeps its place in the picture."""
        asked = self.distance * 0.9 ** float(np.clip(notches, -99, 99))
        distance = float(np.clip(asked, _NEAREST, _FARTHEST))
        if about is None:
            return replace(self, distance=distance)
        kept, share = np.asarray(about, dtype=np.float64), distance / self.distance
        return replace(self, distance=distance, shift=triple(kept + share * (np.asarray(self.shift) - kept)))

    def _toward(self) -> Array:
        a, e = np.radians([self.azimuth, self.elevation])
        return np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])


def pixel_ray(camera: Camera, x: float, y: float, size: tuple[int, int]) -> tuple[Array, Array]:
    """Origin (3,) and unit direction (3,) of the ray through ``(x, y)`` of a pane of ``size`` (width, height) pixels.

    x to the right and y downwards from the pane's corner, pixel centres at .5, as in ``Camera.project``.
    """
    width, height = size
    right, above, toward = camera.axes()
    reach = 2 * np.tan(np.radians(camera.fov) / 2) / height
    direction = reach * (x - width / 2) * right + reach * (height / 2 - y) * above - toward
    return np.asarray(camera.position, dtype=np.float64), direction / np.linalg.norm(direction)


def pixel_size(camera: Camera, points: ArrayLike, height: float) -> Array:
    """Width of one pixel at ``points`` (N, 3), in the mesh's unit: ``(N,)``."""
    _, _, toward = camera.axes()
    depth = (np.asarray(camera.position) - np.asarray(points, dtype=np.float64)) @ toward
    return np.asarray(np.maximum(depth, 1e-12) * 2 * np.tan(np.radians(camera.fov) / 2) / height)
