"""Lines, regions and places that have to be worked out on the surface: run in the worker."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolkit.detail_edit import Curve, Region, Surface, SurfacePoint, drawn, grown, shrunk, within
from viewer.modes.shared.ground import Ground

__all__ = ["line_through", "mirrored", "region_along", "resized", "thinned"]


def thinned(surface: Surface, points: Sequence[SurfacePoint], spacing: float) -> tuple[SurfacePoint, ...]:
    """The points of a stroke that lie at least ``spacing`` apart, the last one kept."""
    kept: list[SurfacePoint] = []
    for point in points:
        if not kept or float(np.linalg.norm(surface.place(point) - surface.place(kept[-1]))) >= spacing:
            kept.append(point)
    if len(points) > 1 and kept[-1] != points[-1]:
        if len(kept) > 1:
            kept.pop()  # the end comes closer than the spacing
        kept.append(points[-1])
    return tuple(kept)


def line_through(ground: Ground, points: Sequence[SurfacePoint]) -> Curve | None:
    """The curve through the points, None of fewer than two."""
    return drawn(ground.surface, list(points)) if len(points) > 1 else None


def region_along(ground: Ground, curve: Curve, width: float, soft: float) -> Region:
    """What lies within a width of a curve; lengths in the result's unit."""
    return within(ground.surface, curve, width / ground.scale, soft / ground.scale)


def resized(ground: Ground, region: Region, distance: float) -> Region:
    """Grown by a distance in the result's unit, or shrunk by a negative one."""
    if distance >= 0:
        return grown(ground.surface, region, distance / ground.scale)
    return shrunk(ground.surface, region, -distance / ground.scale)


def mirrored(ground: Ground, region: Region) -> Region:
    """The region on the other side of the face."""
    return ground.take.mirror.region(region)
