"""Picking: a ray against the displayed mesh on the CPU, and the vertex that the user points at.

The answer is never a vertex on the back of the face or on the other lip: candidates are reached over the surface from
the triangle that the ray hits, and of those only the ones that a ray from the camera reaches.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.rendering import Camera
from viewer.state.cameras import pixel_ray, pixel_size
from viewer.state.events import Hit

__all__ = ["Picker"]

Array = NDArray[np.float64]

# A click that misses the outline by this many pixels still counts, or vertices on it could hardly be picked.
_REACH = 4
_RINGS = 12


class Picker:
    """Answers what a pixel shows, for one mesh as displayed.

    Parameters
    ----------
    vertices : (V, 3) as displayed
    triangles : (F, 3)
    """

    def __init__(self, vertices: NDArray[np.floating], triangles: NDArray[np.integer]) -> None:
        from open3d import core
        from open3d.t.geometry import RaycastingScene

        self.vertices = np.asarray(vertices)
        self.triangles = np.asarray(triangles)
        self._neighbours = _triangles_of_vertices(self.triangles, len(self.vertices))
        self._tensor: Any = core.Tensor
        self._scene = RaycastingScene(nthreads=1)
        points = np.ascontiguousarray(vertices, dtype=np.float32)
        ids = np.ascontiguousarray(triangles, dtype=np.uint32)
        self._scene.add_triangles(core.Tensor(points), core.Tensor(ids))

    def moved(self, vertices: NDArray[np.floating]) -> Picker:
        """A picker of the same connectivity on another shape."""
        other = object.__new__(Picker)
        from open3d import core
        from open3d.t.geometry import RaycastingScene

        other.vertices, other.triangles = np.asarray(vertices), self.triangles
        other._neighbours, other._tensor = self._neighbours, self._tensor
        other._scene = RaycastingScene(nthreads=1)
        points = np.ascontiguousarray(vertices, dtype=np.float32)
        other._scene.add_triangles(core.Tensor(points), core.Tensor(self.triangles.astype(np.uint32)))
        return other

    def pick(self, camera: Camera, x: float, y: float, size: tuple[int, int]) -> Hit | None:
        """What pixel ``(x, y)`` of a pane of ``size`` (width, height) shows; None beside the face."""
        origin, direction = pixel_ray(camera, x, y, size)
        hit = self._first(origin, direction[None])[0]
        if hit is None:
            hit = self._near_miss(camera, x, y, size)
        if hit is None:
            return None
        triangle, barycentric = hit
        position = np.asarray(barycentric) @ self.vertices[self.triangles[triangle]]
        vertex = self._nearest_vertex(triangle, camera, (x, y), size)
        return Hit(triangle, _triple(barycentric), vertex, _triple(position))

    def along(self, origin: Sequence[float] | Array, direction: Sequence[float] | Array) -> Hit | None:
        """What a ray meets first; the nearest corner of that triangle as its vertex."""
        hit = self._first(np.asarray(origin, dtype=np.float64), np.asarray(direction, dtype=np.float64)[None])[0]
        if hit is None:
            return None
        triangle, barycentric = hit
        corners = self.vertices[self.triangles[triangle]]
        position = np.asarray(barycentric) @ corners
        nearest = int(np.argmin(np.linalg.norm(corners - position, axis=1)))
        return Hit(triangle, _triple(barycentric), int(self.triangles[triangle][nearest]), _triple(position))

    def draped(self, origin: Sequence[float] | Array, points: Array, reach: float) -> Array:
        """Points (n, 3) laid on the surface that ``origin`` sees; left where it is farther off than ``reach``."""
        start = np.asarray(origin, dtype=np.float64)
        directions = points - start
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        rays = np.concatenate([np.broadcast_to(start, points.shape), directions], axis=1).astype(np.float32)
        distance = self._scene.cast_rays(self._tensor(rays), nthreads=1)["t_hit"].numpy().astype(np.float64)
        seen = np.isfinite(distance)
        laid = start + np.where(seen, distance, 0.0)[:, None] * directions
        near = seen & (np.linalg.norm(laid - points, axis=1) < reach)
        return np.where(near[:, None], laid, points)

    def visible(self, ids: NDArray[np.integer], camera: Camera) -> NDArray[np.bool_]:
        """Mask ``(n,)`` of the vertices that the camera sees."""
        ids = np.asarray(ids)
        seen, first = self._looked_at(self.vertices[ids], camera)
        # Where the surface is seen edge on, rounding may hit a triangle of the vertex itself a little before it.
        own = (self.triangles[np.minimum(first, len(self.triangles) - 1)] == ids[:, None]).any(axis=1)
        return np.asarray(seen | (own & (first < len(self.triangles))))

    def sees(self, places: NDArray[np.floating], camera: Camera) -> NDArray[np.bool_]:
        """Mask ``(n,)`` of the places (n, 3) on the surface that the camera sees."""
        return self._looked_at(places, camera)[0]

    def _looked_at(self, places: NDArray[np.floating], camera: Camera) -> tuple[NDArray[np.bool_], NDArray[np.integer]]:
        points = np.asarray(places, dtype=np.float64).reshape(-1, 3)
        if not len(points):
            return np.zeros(0, dtype=bool), np.zeros(0, dtype=np.int64)
        origin = np.asarray(camera.position)
        reach = np.linalg.norm(points - origin, axis=1)
        rays = np.concatenate([np.broadcast_to(origin, points.shape), (points - origin) / reach[:, None]], axis=1)
        answer = self._scene.cast_rays(self._tensor(rays.astype(np.float32)), nthreads=1)
        # The ray may also slip between two triangles, and hit nothing.
        return answer["t_hit"].numpy() >= reach * (1 - 1e-4), answer["primitive_ids"].numpy().astype(np.int64)

    def _first(self, origin: Array, directions: Array) -> list[tuple[int, Array] | None]:
        rays = np.concatenate([np.broadcast_to(origin, directions.shape), directions], axis=1).astype(np.float32)
        answer = self._scene.cast_rays(self._tensor(rays), nthreads=1)
        found: list[tuple[int, Array] | None] = []
        ids, uv, reach = (answer[key].numpy() for key in ("primitive_ids", "primitive_uvs", "t_hit"))
        for triangle, (u, v), distance in zip(ids, uv, reach, strict=True):
            inside = np.isfinite(distance)
            found.append((int(triangle), np.array([1 - u - v, u, v], dtype=np.float64)) if inside else None)
        return found

    def _near_miss(self, camera: Camera, x: float, y: float, size: tuple[int, int]) -> tuple[int, Array] | None:
        steps = np.arange(-_REACH, _REACH + 1)
        offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        offsets = offsets[np.argsort((offsets**2).sum(axis=1), kind="stable")]
        offsets = offsets[(offsets**2).sum(axis=1) <= _REACH**2]
        rays = [pixel_ray(camera, x + dx, y + dy, size) for dx, dy in offsets]
        found = self._first(rays[0][0], np.stack([direction for _, direction in rays]))
        return next((hit for hit in found if hit is not None), None)

    def _nearest_vertex(self, triangle: int, camera: Camera, at: tuple[float, float], size: tuple[int, int]) -> int:
        """The visible vertex nearest to ``at``, reached over the surface from ``triangle``."""
        own = self.triangles[triangle]
        starts, members = self._neighbours
        best, nearest, reach = np.inf, -1, np.inf
        known = np.zeros(0, dtype=np.int64)
        frontier = np.asarray(own, dtype=np.int64)
        for ring in range(_RINGS):
            around = np.unique(np.concatenate([members[starts[v] : starts[v + 1]] for v in frontier]))
            new = np.setdiff1d(self.triangles[around], known)
            known = np.union1d(known, new)
            flat = camera.project(self.vertices[new], size)
            apart = np.hypot(flat[:, 0] - at[0], flat[:, 1] - at[1])
            for index in np.argsort(apart, kind="stable"):
                if apart[index] >= best:
                    break
                if self.visible(new[index : index + 1], camera)[0]:
                    best, nearest = float(apart[index]), int(new[index])
            # Where triangles are smaller than a pixel, or seen edge on, the nearest one may be some rings away.
            reach = float(apart.max()) if ring == 0 else reach
            frontier = new[apart <= max(reach, best)]
            if not len(frontier):
                break
        if nearest >= 0:
            return nearest
        corner = camera.project(self.vertices[own], size)
        return int(own[np.argmin(np.hypot(corner[:, 0] - at[0], corner[:, 1] - at[1]))])


def ray_distance(origin: Array, direction: Array, points: NDArray[np.floating]) -> Array:
    """Distance ``(n,)`` of ``points`` (n, 3) from a ray, in the mesh's unit."""
    offset = np.asarray(points, dtype=np.float64) - origin
    along = offset @ direction
    return np.asarray(np.linalg.norm(offset - along[:, None] * direction, axis=1))


def pixels_from_ray(
    origin: Array, direction: Array, points: NDArray[np.floating], camera: Camera, height: int
) -> Array:
    """How far ``points`` (n, 3) appear from the pointer, in pixels: ``(n,)``."""
    return ray_distance(origin, direction, points) / pixel_size(camera, points, height)


def _triangles_of_vertices(
    triangles: NDArray[np.integer], n_vertices: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    corners = triangles.ravel()
    order = np.argsort(corners, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(corners, minlength=n_vertices))])
    return starts, order // 3


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = (float(c) for c in vector)
    return x, y, z
