"""A pinhole camera that knows how to frame a face."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from toolkit.errors import InputError

__all__ = ["Camera", "triple"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    ``position`` and ``target`` (3,) in the mesh's unit, ``up`` (3,) any vector not along the view, ``fov`` the
    vertical opening in degrees.
    """

    position: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    fov: float = 22.0

    @classmethod
    def facing(
        cls,
        vertices: ArrayLike,
        direction: ArrayLike = (0.0, 0.0, 1.0),
        up: ArrayLike = (0.0, 1.0, 0.0),
        *,
        fov: float = 22.0,
        aspect: float = 0.8,
        margin: float = 0.06,
    ) -> Camera:
        """Return a camera that sees all of ``vertices`` (N, 3), centred, looking against ``direction``.

        ``direction`` points from the face to the camera, ``aspect`` is the picture's width / height, ``margin`` the
        share of the picture left free on each side of the tighter dimension.
        """
        points = np.asarray(vertices, dtype=np.float64).reshape(-1, 3)
        if len(points) == 0 or not np.isfinite(points).all():
            raise InputError(f"a camera cannot frame {len(points)} points that are not all finite")
        probe = cls((0.0, 0.0, 0.0), triple(-np.asarray(direction, dtype=np.float64)), triple(up), fov)
        right, above, toward = probe.axes()
        flat = points @ np.stack([right, above, toward], axis=1)
        low, high = flat.min(axis=0), flat.max(axis=0)
        middle = (low + high) / 2
        half = np.tan(np.radians(fov) / 2) * (1 - 2 * margin)
        # Every point must lie inside both pairs of the frustum's planes: the farthest one away from the axis decides.
        reach = np.maximum(np.abs(flat[:, 0] - middle[0]) / aspect, np.abs(flat[:, 1] - middle[1])) / half
        distance = float(np.max(reach + flat[:, 2] - middle[2]))
        centre = middle[0] * right + middle[1] * above + middle[2] * toward
        distance = max(distance, 1e-6 * (1 + float(np.abs(points).max())))
        return cls(triple(centre + distance * toward), triple(centre), triple(up), fov)

    def orbited(self, azimuth: float = 0.0, elevation: float = 0.0) -> Camera:
        """Return the camera turned about its target, in degrees: to the picture's right, then upwards."""
        right, above, toward = self.axes()
        a, e = np.radians([azimuth, elevation])
        turned = np.cos(e) * (np.cos(a) * toward + np.sin(a) * right) + np.sin(e) * above
        return replace(self, position=triple(np.asarray(self.target) + self.distance * turned))

    @property
    def distance(self) -> float:
        """Distance from the camera to its target, in the mesh's unit."""
        return float(np.linalg.norm(np.subtract(self.position, self.target)))

    def axes(self) -> tuple[Array, Array, Array]:
        """Return unit vectors (right, up, toward the viewer), each (3,)."""
        toward = _unit(np.subtract(self.position, self.target))
        right = np.cross(np.asarray(self.up, dtype=np.float64), toward)
        if np.linalg.norm(right) < 1e-9:  # looking along ``up``: any upright will do, but always the same one
            right = np.cross([0.0, 0.0, -1.0] if abs(toward[1]) > 0.5 else [0.0, 1.0, 0.0], toward)
        right = _unit(right)
        return right, np.cross(toward, right), toward

    def project(self, points: ArrayLike, size: tuple[int, int]) -> Array:
        """Return ``(N, 3)``: x and y in pixels (y downwards, pixel centres at .5), and the depth along the view.

        ``size`` is (width, height) of the picture. A depth below zero is behind the camera; its x and y mean nothing.
        """
        width, height = size
        local = (np.asarray(points, dtype=np.float64) - self.position) @ np.stack(self.axes(), axis=1)
        depth = -local[:, 2]
        scale = height / (2 * np.tan(np.radians(self.fov) / 2))
        safe = np.where(np.abs(depth) < 1e-12, 1e-12, depth)
        return np.stack(
            [width / 2 + scale * local[:, 0] / safe, height / 2 - scale * local[:, 1] / safe, depth], axis=1
        )


def triple(vector: ArrayLike) -> tuple[float, float, float]:
    """Three numbers as plain ones, for what is compared by value."""
    x, y, z = (float(c) for c in np.asarray(vector, dtype=np.float64))
    return x, y, z


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), 1e-300)
