"""Picking: a ray against the displayed mesh on the CPU, and the vertex that the user points at.

The answer is never a vertex on the back of the face or on the other lip: candidates are reached over the surface from
the triangle that the ray hits, and of those only the ones that a ray from the camera reaches.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from toolkit.rendering import Camera
from toolkit.rendering.camera import triple
from viewer.raycast import first_hits, triangles_of_vertices
from viewer.state.cameras import pixel_ray, pixel_size
from viewer.state.events import Hit

__all__ = ["Picker", "pixels_from_ray"]

Array = NDArray[np.float64]

# A click that misses the outline by this many pixels still counts, or vertices on it could hardly be picked.
_REACH = 4
_RINGS = 12


class Picker:
    """Answers what a pixel shows, for one mesh as displayed; as good as free to make.

    Parameters
    ----------
    vertices : (V, 3) as displayed
    triangles : (F, 3)
    """

    def __init__(self, vertices: NDArray[np.floating], triangles: NDArray[np.integer]) -> None:
        self.triangles = np.ascontiguousarray(triangles, dtype=np.int32)
        self._around = triangles_of_vertices(self.triangles, len(vertices))
        self._put(vertices)

    def moved(self, vertices: NDArray[np.floating]) -> Picker:
        """A picker of the same connectivity on another shape."""
        other = copy.copy(self)
        other._put(vertices)
        return other

    def _put(self, vertices: NDArray[np.floating]) -> None:
        self.vertices = np.ascontiguousarray(vertices, dtype=np.float32)

    def pick(self, camera: Camera, x: float, y: float, size: tuple[int, int]) -> Hit | None:
        """What pixel ``(x, y)`` of a pane of ``size`` (width, height) shows; None beside the face."""
        origin, direction = pixel_ray(camera, x, y, size)
        hit = self._hits(origin, direction[None])[0] or self._near_miss(camera, x, y, size)
        if hit is None:
            return None
        vertex = self._nearest_vertex(hit.triangle, camera, (x, y), size)
        return replace(hit, vertex=vertex)

    def along(self, origin: Sequence[float] | Array, direction: Sequence[float] | Array) -> Hit | None:
        """What a ray meets first; the nearest corner of that triangle as its vertex."""
        return self._hits(origin, np.asarray(direction, dtype=np.float64)[None])[0]

    def along_all(self, origin: Sequence[float] | Array, directions: Array) -> list[Hit]:
        """The same of several unit ``directions`` (n, 3), without those that meet nothing."""
        return [hit for hit in self._hits(origin, directions) if hit is not None]

    def draped(self, origin: Sequence[float] | Array, points: Array, reach: float) -> Array:
        """Points (n, 3) laid on the surface that ``origin`` sees; left where it is farther off than ``reach``."""
        start = np.asarray(origin, dtype=np.float64)
        directions = points - start
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        _, _, distance = self._first(start, directions, directions.mean(axis=0))
        seen = np.isfinite(distance)
        laid = start + np.where(seen, distance, 0.0)[:, None] * directions
        near = seen & (np.linalg.norm(laid - points, axis=1) < reach)
        return np.where(near[:, None], laid, points)

    def normal(self, triangle: int) -> Array:
        """The unit normal at a triangle, evened out over those round it, ``(3,)``."""
        a, b, c = (self.vertices[self.triangles[self._round(self.triangles[triangle]), k]] for k in range(3))
        normal = np.cross((b - a).astype(np.float64), c - a).sum(axis=0)
        return np.asarray(normal / max(float(np.linalg.norm(normal)), 1e-300))

    def visible(self, ids: NDArray[np.integer], camera: Camera) -> NDArray[np.bool_]:
        """Mask ``(n,)`` of the vertices that the camera sees."""
        ids = np.asarray(ids, dtype=np.int64)
        seen, first = self._looked_at(self.vertices[ids], camera)
        # Where the surface is seen edge on, rounding may hit a triangle of the vertex itself a little before it.
        return np.asarray(seen | ((self.triangles[first] == ids[:, None]).any(axis=1) & (first >= 0)))

    def sees(self, places: NDArray[np.floating], camera: Camera) -> NDArray[np.bool_]:
        """Mask ``(n,)`` of the places (n, 3) on the surface that the camera sees."""
        return self._looked_at(places, camera)[0]

    def _looked_at(self, places: NDArray[np.floating], camera: Camera) -> tuple[NDArray[np.bool_], NDArray[np.integer]]:
        origin = np.asarray(camera.position, dtype=np.float64)
        offsets = np.asarray(places, dtype=np.float64).reshape(-1, 3) - origin
        reach = np.linalg.norm(offsets, axis=1)
        ahead = -camera.axes()[2]
        first, _, distance = self._first(origin, offsets / np.maximum(reach, 1e-300)[:, None], ahead)
        return (distance >= reach * (1 - 1e-4)) & (offsets @ ahead > 0), first

    def _first(self, origin: Array, directions: Array, forward: Array) -> tuple[NDArray[np.int64], Array, Array]:
        return first_hits(self.vertices, self.triangles, origin, directions, forward)

    def _hits(self, origin: Sequence[float] | Array, directions: Array) -> list[Hit | None]:
        start = np.asarray(origin, dtype=np.float64)
        found = self._first(start, directions, np.mean(directions, axis=0))
        return [
            self._hit(int(triangle), weights) if triangle >= 0 else None
            for triangle, weights, _ in zip(*found, strict=True)
        ]

    def _hit(self, triangle: int, weights: Array) -> Hit:
        ids = self.triangles[triangle]
        corners = self.vertices[ids].astype(np.float64)
        position = weights @ corners
        nearest = int(ids[np.argmin(np.linalg.norm(corners - position, axis=1))])
        return Hit(triangle, triple(weights), nearest, triple(position))

    def _near_miss(self, camera: Camera, x: float, y: float, size: tuple[int, int]) -> Hit | None:
        steps = np.arange(-_REACH, _REACH + 1)
        offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        offsets = offsets[np.argsort((offsets**2).sum(axis=1), kind="stable")]
        offsets = offsets[(offsets**2).sum(axis=1) <= _REACH**2]
        rays = [pixel_ray(camera, x + dx, y + dy, size) for dx, dy in offsets]
        return next(iter(self.along_all(rays[0][0], np.stack([direction for _, direction in rays]))), None)

    def _round(self, ids: NDArray[np.integer]) -> NDArray[np.int64]:
        """The triangles round some vertices."""
        starts, members = self._around
        return np.unique(np.concatenate([members[starts[v] : starts[v + 1]] for v in ids]))

    def _nearest_vertex(self, triangle: int, camera: Camera, at: tuple[float, float], size: tuple[int, int]) -> int:
        """The visible vertex nearest to ``at``, reached over the surface from ``triangle``."""
        own = self.triangles[triangle]
        best, nearest, reach = np.inf, -1, np.inf
        known = np.zeros(0, dtype=np.int64)
        frontier = np.asarray(own, dtype=np.int64)
        for ring in range(_RINGS):
            new = np.setdiff1d(self.triangles[self._round(frontier)], known)
            known = np.union1d(known, new)
            apart = _apart(self.vertices[new], camera, at, size)
            nearer = np.flatnonzero(apart < best)
            if len(nearer):
                nearer = nearer[self.visible(new[nearer], camera)]
            if len(nearer):
                first = nearer[np.argmin(apart[nearer])]
                best, nearest = float(apart[first]), int(new[first])
            # Where triangles are smaller than a pixel, or seen edge on, the nearest one may be some rings away.
            reach = float(apart.max(initial=0)) if ring == 0 else reach
            frontier = new[apart <= max(reach, best)]
            if not len(frontier):
                break
        return nearest if nearest >= 0 else int(own[np.argmin(_apart(self.vertices[own], camera, at, size))])


def _apart(points: NDArray[np.floating], camera: Camera, at: tuple[float, float], size: tuple[int, int]) -> Array:
    """How far from ``at`` points (n, 3) are seen, in pixels: ``(n,)``."""
    flat = camera.project(points, size)
    return np.asarray(np.hypot(flat[:, 0] - at[0], flat[:, 1] - at[1]))


def pixels_from_ray(
    origin: Array, direction: Array, points: NDArray[np.floating], camera: Camera, height: float
) -> Array:
    """How far ``points`` (n, 3) appear from the pointer, in pixels: ``(n,)``."""
    offset = np.asarray(points, dtype=np.float64) - origin
    apart = np.linalg.norm(offset - (offset @ direction)[:, None] * direction, axis=1)
    return np.asarray(apart / pixel_size(camera, points, height))
