"""Curves drawn on the surface: shortest ways between the points that the user gave."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from toolkit.detail_edit.ground import Ground
from toolkit.detail_edit.surface import Curve, Surface, SurfacePoint, as_curve
from toolkit.errors import InputError
from toolkit.mesh import edge_graph

__all__ = ["drawn", "snapped"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

_RELAXATIONS = 30
_LAST_RELAXATIONS = 8
_BESIDE = 0.2
"""How far beside the way along the edges the shortest one may lie, as a share of the length."""


def snapped(surface: Surface, points: NDArray[np.floating]) -> list[SurfacePoint]:
    """The points of the surface closest to places ``(n, 3)``."""
    _, triangles, weights = Ground(surface).closest(np.asarray(points, dtype=np.float64))
    return [
        SurfacePoint(int(f), (float(a), float(b), float(c))) for f, (a, b, c) in zip(triangles, weights, strict=True)
    ]


def drawn(surface: Surface, points: Sequence[SurfacePoint]) -> Curve:
    """A curve through the points, by the shortest way along the surface between each and the next.

    Its points lie half an edge apart. The shortest way along the edges is laid down first and then drawn tight: points
    move to the middle between their neighbours, put back on the surface, at a finer and finer spacing.
    """
    if len(points) < 2:
        raise InputError(f"a curve through {len(points)} point is none", remedy="give at least two points")
    ends = as_curve(points)
    surface.check_triangles(ends.triangles)
    path = _Ways(surface)
    parts = [path.tight(a, b) for a, b in pairwise(points)]
    triangles = np.concatenate([parts[0].triangles[:1], *[part.triangles[1:] for part in parts]])
    return Curve(triangles, np.concatenate([parts[0].weights[:1], *[part.weights[1:] for part in parts]]))


class _Ways:
    """Shortest ways; what depends on the surface alone is made once for all parts of a curve."""

    def __init__(self, surface: Surface) -> None:
        self._surface = surface
        self._graph = edge_graph(surface.vertices, surface.edges)

    def tight(self, start: SurfacePoint, end: SurfacePoint) -> Curve:
        """The shortest curve on the surface between two points."""
        surface = self._surface
        a, b = surface.place(start), surface.place(end)
        way = self._along_edges(start, end)
        spacing = 0.5 * surface.edge(way)
        line = np.concatenate([[a], surface.vertices[way], [b]])
        length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
        beside = surface.distance_from_vertices(way, _BESIDE * length + 4 * spacing)
        ground = Ground(surface, surface.triangles_at(np.flatnonzero(np.isfinite(beside))))
        finest = max(int(np.ceil(length / spacing)), 1) + 1
        counts = [finest]
        while counts[0] > 3:
            counts.insert(0, counts[0] // 2 + 1)
        for count in counts:
            line = _resampled(line, count)
            for _ in range(_RELAXATIONS if count < 40 else _LAST_RELAXATIONS):
                line[1:-1] = ground.closest((line[:-2] + line[2:]) / 2)[0]
        line = _resampled(line, finest)
        _, triangles, weights = ground.closest(line)
        triangles[[0, -1]] = start.triangle, end.triangle
        weights[[0, -1]] = start.weights, end.weights
        return Curve(triangles, weights)

    def _along_edges(self, start: SurfacePoint, end: SurfacePoint) -> Ids:
        """Vertices on the shortest way along edges, from a corner of one triangle to a corner of the other."""
        corners = self._surface.triangles
        first = int(corners[start.triangle][int(np.argmax(start.weights))])
        last = int(corners[end.triangle][int(np.argmax(end.weights))])
        limit = 2 * float(np.linalg.norm(self._surface.vertices[first] - self._surface.vertices[last]))
        for reach in (limit, np.inf):
            distance, before = dijkstra(self._graph, indices=first, return_predecessors=True, limit=reach)
            if np.isfinite(distance[last]):
                break
        else:
            raise InputError(
                "two points of the curve lie on parts of the face that do not hang together",
                remedy="draw the curve on one part",
            )
        way = [last]
        while way[-1] != first:
            way.append(int(before[way[-1]]))
        return np.array(way[::-1], dtype=np.int64)


def _resampled(line: Array, count: int) -> Array:
    """Points ``(count, d)`` evenly spread by arc length along a polyline ``(n, d)``."""
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    at = np.concatenate([[0], np.cumsum(steps)])
    asked = np.linspace(0, at[-1], count)
    return np.stack([np.interp(asked, at, column) for column in line.T], axis=1)
