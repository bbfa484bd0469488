"""The surface that regions and curves are drawn on: points on it, and distances along it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit.marching import march, seeds_round
from toolkit.errors import InputError
from toolkit.mesh.topology import unique_edges

__all__ = ["Curve", "Surface", "SurfacePoint", "as_curve"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True)
class SurfacePoint:
    """A point in a triangle: its id and three weights that add up to 1. It means the same in every frame and pose."""

    triangle: int
    weights: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Curve:
    """A line on the surface: ``triangles`` (n,) ids and ``weights`` (n, 3) of its points, in their order."""

    triangles: Ids
    weights: Array

    def __len__(self) -> int:
        return len(self.triangles)

    def point(self, index: int) -> SurfacePoint:
        """One of its points."""
        return SurfacePoint(int(self.triangles[index]), _triple(self.weights[index]))


class Surface:
    """A triangle mesh as ground for drawing.

    Parameters
    ----------
    vertices : (V, 3) the rest shape; lengths are in its unit. The smoothed one, so that pores don't lengthen the way.
    triangles : (F, 3)
    """

    def __init__(self, vertices: NDArray[np.floating], triangles: NDArray[np.integer]) -> None:
        self.vertices = np.ascontiguousarray(vertices, dtype=np.float64)
        self.triangles = np.ascontiguousarray(triangles, dtype=np.int64)
        corners = self.triangles.ravel()
        order = np.argsort(corners, kind="stable")
        self._around = order // 3
        self._first = np.concatenate([[0], np.cumsum(np.bincount(corners, minlength=len(self.vertices)))])

    @property
    def n_vertices(self) -> int:
        """Number of vertices V."""
        return len(self.vertices)

    @cached_property
    def edges(self) -> Ids:
        """Each edge once, ``(E, 2)``."""
        return unique_edges(self.triangles)

    @cached_property
    def _edge_at(self) -> Array:
        """Mean length of the edges at each vertex ``(V,)``."""
        i, j = self.edges.T
        lengths = np.linalg.norm(self.vertices[i] - self.vertices[j], axis=1)
        ends = self.edges.T.ravel()
        total = np.bincount(ends, np.tile(lengths, 2), self.n_vertices)
        return np.asarray(total / np.maximum(np.bincount(ends, minlength=self.n_vertices), 1))

    def edge(self, vertices: Ids | None = None) -> float:
        """Median over the vertices, or over some (n,), of the mean length of the edges there."""
        at = self._edge_at if vertices is None else self._edge_at[vertices]
        return float(np.median(at))

    def triangles_at(self, vertices: Ids) -> Ids:
        """Ids of the triangles that have a corner among the vertices (n,), sorted."""
        starts, counts = self._first[vertices], self._first[vertices + 1] - self._first[vertices]
        steps = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        return np.unique(self._around[np.repeat(starts, counts) + steps])

    def triangles_within(self, vertices: Ids) -> Ids:
        """Ids of the triangles whose corners are all among the vertices (n,), sorted."""
        inside = np.zeros(self.n_vertices, dtype=bool)
        inside[vertices] = True
        near = self.triangles_at(vertices)
        return near[inside[self.triangles[near]].all(axis=1)]

    def place(self, point: SurfacePoint) -> Array:
        """Where a point is, ``(3,)``."""
        return np.asarray(np.array(point.weights) @ self.vertices[self.triangles[point.triangle]])

    def places(self, curve: Curve) -> Array:
        """Where a curve's points are, ``(n, 3)``."""
        return np.asarray(np.einsum("nk,nkd->nd", curve.weights, self.vertices[self.triangles[curve.triangles]]))

    def at_vertex(self, vertex: int) -> SurfacePoint:
        """A vertex as a point of the surface."""
        self.check_vertices(np.array([vertex]))
        if self._first[vertex] == self._first[vertex + 1]:
            raise InputError(
                f"vertex {vertex} belongs to no triangle, so nothing can be drawn there", remedy="choose another vertex"
            )
        triangle = int(self._around[self._first[vertex]])
        return SurfacePoint(triangle, _triple((self.triangles[triangle] == vertex).astype(float)))

    def distance(self, sources: Curve | Sequence[SurfacePoint], limit: float = np.inf) -> Array:
        """Distance along the surface ``(V,)`` from points or from a curve, infinite beyond ``limit``."""
        curve = sources if isinstance(sources, Curve) else as_curve(sources)
        self.check_triangles(curve.triangles)
        ground = (self.vertices, self.triangles, self._first, self._around)
        seeds, starts, labels = seeds_round(*ground, self.places(curve), curve.triangles)
        return self._march(seeds, starts, labels, limit)

    def distance_from_vertices(self, vertices: Ids, limit: float = np.inf, starts: Array | None = None) -> Array:
        """Distance ``(V,)`` from a set of vertices (n,), which start at 0 or at ``starts`` (n,)."""
        self.check_vertices(vertices)
        begin = np.zeros(len(vertices)) if starts is None else np.asarray(starts, dtype=np.float64)
        return self._march(vertices, begin, np.arange(len(vertices)), limit)

    def check_vertices(self, vertices: Ids) -> None:
        """Raise ``InputError`` for ids that the mesh does not have."""
        _check(vertices, self.n_vertices, "vertex")

    def check_triangles(self, triangles: Ids) -> None:
        """Raise ``InputError`` for ids that the mesh does not have."""
        _check(triangles, len(self.triangles), "triangle")

    def _march(self, seeds: Ids, starts: Array, labels: Ids, limit: float) -> Array:
        ids = np.asarray(seeds, dtype=np.int64)
        distance, _ = march(
            self.vertices, self.triangles, self._first, self._around, ids, starts, labels.astype(np.int64), limit
        )
        distance[distance > limit] = np.inf
        return np.asarray(distance)


def as_curve(points: Sequence[SurfacePoint]) -> Curve:
    """Points of the surface as arrays."""
    if not points:
        raise InputError("a curve or a brush needs at least one point on the surface")
    return Curve(
        np.array([point.triangle for point in points], dtype=np.int64),
        np.array([point.weights for point in points], dtype=np.float64),
    )


def _check(ids: Ids, count: int, what: str) -> None:
    wrong = ids[(ids < 0) | (ids >= count)]
    if len(wrong):
        raise InputError(f"there is no {what} {wrong[0]}: they go from 0 to {count - 1}")


def _triple(values: Array | NDArray[np.floating]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
