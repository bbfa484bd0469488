"""Left and right of a face that is nearly, but not exactly, the same on both sides."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.detail_edit.ground import Ground
from toolkit.detail_edit.region import Region
from toolkit.detail_edit.surface import Surface, SurfacePoint
from toolkit.mesh.geometry import vertex_normals

__all__ = ["Mirror"]

Array = NDArray[np.float64]

_SAMPLES = 3000
_FEW = 600
_ROUNDS = 30
_WARP_ROUNDS = 3


class Mirror:
    """The plane between left and right, found from the shape, and the map from one side to the other.

    The plane is fitted by reflecting the face and drawing it to itself, from each of its three main axes; the one that
    fits best is taken. A face is only nearly symmetric: the reflected shape is therefore warped smoothly on to the
    surface (a mean over some centimetres of where its points would go) before the closest points are taken.
    """

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        used = np.unique(surface.triangles)
        sample = used[:: max(len(used) // _SAMPLES, 1)]
        self._points = surface.vertices[sample]
        normals = vertex_normals(surface.vertices, surface.triangles)[used]
        face = _Face(surface.vertices[used], normals, cKDTree(surface.vertices[used]))
        self.point, self.normal = _best_plane(self._points, face)

    def reflected(self, points: Array) -> Array:
        """Points ``(n, 3)`` on the other side of the plane."""
        return np.asarray(points - 2 * np.multiply.outer((points - self.point) @ self.normal, self.normal))

    @property
    def reflection(self) -> Array:
        """The matrix ``(3, 3)`` that reflects directions."""
        return np.asarray(np.eye(3) - 2 * np.outer(self.normal, self.normal))

    def across(self, point: SurfacePoint) -> SurfacePoint:
        """The point on the other side."""
        _, triangles, weights = self._ground.closest(self._warped(self._surface.place(point)[None]))
        a, b, c = (float(weight) for weight in weights[0])
        return SurfacePoint(int(triangles[0]), (a, b, c))

    def region(self, region: Region) -> Region:
        """The region on the other side, with its soft weights."""
        surface, field = self._surface, region.field(self._surface.n_vertices)
        there = self._warped(surface.vertices[region.vertices])
        near, _ = cKDTree(there).query(surface.vertices)
        candidates = np.flatnonzero(near <= 3 * surface.edge(region.vertices))
        _, triangles, inside = self._ground.closest(self._warped(surface.vertices[candidates]))
        weights = np.einsum("nk,nk->n", inside, field[surface.triangles[triangles]])
        if (region.weights == 1).all():  # a hard border stays hard
            weights = np.round(weights)
        kept = weights > 1e-3
        return Region(candidates[kept], np.clip(weights[kept], 0, 1))

    def _warped(self, points: Array) -> Array:
        """Where points ``(n, 3)`` come to lie on the other side, before they are put on the surface."""
        moved = self.reflected(points)
        _, near = self._shifts[0].query(moved, k=min(12, len(self._points)))
        return np.asarray(moved + self._shifts[1][near].mean(axis=1))

    @cached_property
    def _ground(self) -> Ground:
        return Ground(self._surface)

    @cached_property
    def _shifts(self) -> tuple[cKDTree, Array]:
        """Samples on the other side, and how far each has to go to lie on the surface, smoothed."""
        moved = self.reflected(self._points)
        shift = np.zeros_like(moved)
        tree = cKDTree(moved)
        _, near = tree.query(moved, k=min(40, len(moved)))
        for _ in range(_WARP_ROUNDS):
            shift += (self._ground.closest(moved + shift)[0] - moved - shift)[near].mean(axis=1)
        return tree, shift


@dataclass(frozen=True, eq=False)
class _Face:
    """All places of a face (n, 3) with their normals, to be looked up."""

    places: Array
    normals: Array
    tree: cKDTree


def _best_plane(points: Array, face: _Face) -> tuple[Array, Array]:
    """The plane that fits best from any of the three main axes; found on few points, then refined on all."""
    centre = points.mean(axis=0)
    few = points[:: max(len(points) // _FEW, 1)]
    axes = np.linalg.eigh(np.cov((points - centre).T))[1].T
    fits = [_fitted_plane(few, face, centre, axis) for axis in axes]
    _, point, normal = min(fits, key=lambda fit: fit[0])
    return _fitted_plane(points, face, point, normal)[1:]


def _fitted_plane(points: Array, face: _Face, point: Array, normal: Array) -> tuple[float, Array, Array]:
    """Refine a plane; returns the mean distance of the reflected points from the face, and the plane.

    Gauss-Newton on the distances to the tangent planes at the closest places, the farthest fifth left out; three
    unknowns: the plane's shift and its normal's two turns.
    """
    off = np.inf
    for _ in range(_ROUNDS):
        height = (points - point) @ normal
        reflected = points - 2 * height[:, None] * normal
        distance, nearest = face.tree.query(reflected)
        pairs = distance <= np.quantile(distance, 0.8)
        off = float(distance[pairs].mean())
        p, h, there = points[pairs] - point, height[pairs], nearest[pairs]
        out = face.normals[there]
        turns = np.linalg.svd(normal[None])[2][1:]
        moves = [-2 * ((p @ turn)[:, None] * normal + h[:, None] * turn) for turn in turns]
        slopes = np.stack([*((out * move).sum(axis=1) for move in moves), 2 * out @ normal], axis=1)
        residual = (out * (reflected[pairs] - face.places[there])).sum(axis=1)
        step = np.linalg.lstsq(slopes, -residual, rcond=None)[0]
        point = point + step[2] * normal
        normal = normal + step[:2] @ turns
        normal = normal / np.linalg.norm(normal)
        if np.abs(step).max() < 1e-9:
            break
    return off, point, normal
