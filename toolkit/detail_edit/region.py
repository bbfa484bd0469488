"""Which part of the face an edit is about: vertices with soft weights, however they were chosen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit.surface import Curve, Surface, SurfacePoint
from toolkit.errors import InputError

__all__ = ["Dab", "Region", "banded", "grown", "middle_of", "painted", "shrunk", "within"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

_LEVELS = 16


@dataclass(frozen=True, eq=False)
class Region:
    """``vertices`` (n,) ids, ascending, and ``weights`` (n,) above 0, at most 1: how far an edit holds each."""

    vertices: Ids
    weights: Array

    def __post_init__(self) -> None:
        ids, weights = np.asarray(self.vertices), np.asarray(self.weights, dtype=np.float64)
        if len(ids) and ids.dtype.kind not in "iu":
            raise InputError("a region's vertices are not all whole numbers")
        if ids.ndim != 1 or ids.shape != weights.shape:
            raise InputError(f"a region has {ids.shape} vertices and {weights.shape} weights; both must be (n,)")
        if not np.isfinite(weights).all() or (weights < 0).any() or (weights > 1).any():
            raise InputError("a region's weights must be numbers from 0 to 1")
        order = np.argsort(ids, kind="stable")
        ids, weights = ids[order].astype(np.int64), weights[order]
        if (len(ids) and ids[0] < 0) or (np.diff(ids) == 0).any():
            raise InputError("a region's vertices must be ids from 0 on, each named once")
        object.__setattr__(self, "vertices", ids[weights > 0])
        object.__setattr__(self, "weights", weights[weights > 0])

    @classmethod
    def of(cls, field: Array) -> Region:
        """From a weight for every vertex of the face ``(V,)``."""
        ids = np.flatnonzero(field > 0)
        return cls(ids, np.minimum(field[ids], 1.0))

    @classmethod
    def whole(cls, vertices: Sequence[int] | Ids) -> Region:
        """Vertices that all count in full."""
        ids = np.unique(np.asarray(vertices, dtype=np.int64))
        return cls(ids, np.ones(len(ids)))

    def __len__(self) -> int:
        return len(self.vertices)

    def field(self, n_vertices: int) -> Array:
        """The weight of every vertex of the face ``(V,)``."""
        if len(self) and self.vertices[-1] >= n_vertices:
            raise InputError(
                f"the region has a vertex {self.vertices[-1]}, the face only {n_vertices} vertices",
                remedy="select it again on this face",
            )
        field = np.zeros(n_vertices)
        field[self.vertices] = self.weights
        return field

    def joined(self, other: Region) -> Region:
        """Both together."""
        n = 1 + max(int(ids.max(initial=0)) for ids in (self.vertices, other.vertices))
        return Region.of(np.maximum(self.field(n), other.field(n)))

    def without(self, other: Region) -> Region:
        """What of it the other does not cover."""
        n = 1 + max(int(ids.max(initial=0)) for ids in (self.vertices, other.vertices))
        return Region.of(np.minimum(self.field(n), 1 - other.field(n)))


@dataclass(frozen=True)
class Dab:
    """One touch of a soft brush.

    ``point`` its middle, ``radius`` along the surface in its unit, ``strength`` 0 to 1 of what it adds (or takes away,
    with ``erase``) in the middle; full up to ``hardness`` of the radius, then falling to nothing, smoothly.
    """

    point: SurfacePoint
    radius: float
    strength: float = 1.0
    hardness: float = 0.5
    erase: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite(self.radius) and self.radius > 0):
            raise InputError(f"a brush of radius {self.radius} paints nothing", remedy="give a radius above 0")
        if not (0 <= self.hardness <= 1 and 0 <= self.strength <= 1):
            raise InputError("a brush's strength and hardness go from 0 to 1")


def painted(surface: Surface, dabs: Sequence[Dab], start: Region | None = None) -> Region:
    """What the dabs leave, one after another, on nothing or on a ``start``."""
    field = np.zeros(surface.n_vertices) if start is None else start.field(surface.n_vertices)
    for dab in dabs:
        distance = surface.distance([dab.point], dab.radius)
        near = np.flatnonzero(np.isfinite(distance))
        beyond = np.clip((distance[near] / dab.radius - dab.hardness) / max(1 - dab.hardness, 1e-9), 0, 1)
        touch = dab.strength * (1 - beyond**2 * (3 - 2 * beyond))
        field[near] = np.clip(field[near] - touch if dab.erase else field[near] + touch, 0, 1)
    return Region.of(field)


def within(surface: Surface, curve: Curve, distance: float, soft: float = 0.0) -> Region:
    """Everything within a distance of a curve (the paper's section 5.2), fading over ``soft`` more."""
    if not (np.isfinite(distance) and distance >= 0 and np.isfinite(soft) and soft >= 0):
        raise InputError(
            f"a distance of {distance} with a soft border of {soft} selects nothing", remedy="give numbers from 0 on"
        )
    away = surface.distance(curve, distance + soft)
    return Region.of(_fading(away - distance, soft))


def grown(surface: Surface, region: Region, distance: float) -> Region:
    """The region with all that lies within a distance of it; a soft border moves out as it is."""

    def larger(ids: Ids) -> Ids:
        return np.flatnonzero(np.isfinite(surface.distance_from_vertices(ids, distance)))

    return _by_level(surface, region, larger)


def shrunk(surface: Surface, region: Region, distance: float) -> Region:
    """The region less all that lies within a distance of its outside; the face's own border is no outside."""

    def smaller(ids: Ids) -> Ids:
        inside = np.zeros(surface.n_vertices, dtype=bool)
        inside[ids] = True
        near = np.unique(surface.triangles[surface.triangles_at(ids)])
        outside = near[~inside[near]]
        if len(outside) == 0:
            return ids
        return ids[~np.isfinite(surface.distance_from_vertices(outside, distance)[ids])]

    return _by_level(surface, region, smaller)


def banded(surface: Surface, region: Region, width: float) -> Region:
    """The region with a smoothing band: weights fall to 0 outside, linearly, by 1 over ``width`` along the surface.

    Weights inside stay. A border that is softer than that already stays as it is.
    """
    if width <= 0 or len(region) == 0:
        return region
    starts = (1 - region.weights) * width
    distance = surface.distance_from_vertices(region.vertices, width, starts)
    field = np.where(np.isfinite(distance), 1 - distance / width, 0.0)
    return Region.of(np.maximum(field, region.field(surface.n_vertices)))


def middle_of(surface: Surface, region: Region) -> SurfacePoint:
    """The region's vertex nearest to its middle."""
    surface.check_vertices(region.vertices)
    places = surface.vertices[region.vertices]
    away = np.linalg.norm(places - np.average(places, axis=0, weights=region.weights), axis=1)
    # Only where it holds in full, or a thin bow's middle would lie beside it.
    away[region.weights < 0.5 * region.weights.max()] = np.inf
    return surface.at_vertex(int(region.vertices[np.argmin(away)]))


def _by_level(surface: Surface, region: Region, change: Callable[[Ids], Ids]) -> Region:
    """Change the set of vertices above each level of the weights, and pile the sets up again."""
    soft = bool(len(region)) and bool(region.weights.min() < 1 - 1e-9)
    levels = np.linspace(1 / _LEVELS, 1, _LEVELS) if soft else np.ones(1)
    field = np.zeros(surface.n_vertices)
    surface.check_vertices(region.vertices)
    for level in levels:
        ids = region.vertices[region.weights >= level - 1e-9]
        if len(ids):
            field[change(ids)] = level
    return Region.of(field)


def _fading(beyond: Array, width: float) -> Array:
    if width <= 0:
        return (beyond <= 0).astype(np.float64)
    return np.where(np.isfinite(beyond), np.clip(1 - beyond / width, 0, 1), 0.0)
