"""From the pointer's ray to places: in the view plane, on a tangent plane, near something drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from viewer.picking import pixels_from_ray
from viewer.state.events import Pointer

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["on_plane", "pointed_at", "shows_result", "surface_places"]

Array = NDArray[np.float64]

_BEHIND = 0.03  # of the way to the camera: what lies deeper than this under the face cannot be taken hold of


def shows_result(app: App, pane: int) -> bool:
    """Whether a pane shows the face that edits change."""
    return (app.pair.right if pane else app.pair.left) == "result"


def on_plane(event: Pointer, point: ArrayLike, normal: ArrayLike) -> Array | None:
    """Where the ray meets the plane through ``point`` (3,) across ``normal`` (3,); None if it runs along it."""
    origin, direction = np.asarray(event.origin), np.asarray(event.direction)
    steep = float(direction @ np.asarray(normal))
    if abs(steep) < 1e-3:
        return None
    return np.asarray(origin + float((np.asarray(point) - origin) @ np.asarray(normal)) / steep * direction)


def pointed_at(app: App, event: Pointer, places: Sequence[ArrayLike], pixels: float) -> int:
    """Index of the place (3,) nearest to the pointer within ``pixels``, or -1; none that the face hides."""
    if not len(places):
        return -1
    points = np.asarray(places, dtype=np.float64)
    camera, height = app.framing_camera(event.pane), app.plain_height(event.pane)
    away = pixels_from_ray(np.asarray(event.origin), np.asarray(event.direction), points, camera, height)
    if event.hit is not None:
        origin = np.asarray(event.origin)
        depth = np.linalg.norm(np.asarray(event.hit.position) - origin)
        away = np.where(np.linalg.norm(points - origin, axis=1) > depth * (1 + _BEHIND), np.inf, away)
    nearest = int(np.argmin(away))
    return nearest if away[nearest] <= pixels else -1


def surface_places(app: App, pane: int, triangles: ArrayLike, weights: ArrayLike) -> Array:
    """Where points of the surface, triangle ids (n,) and weights (n, 3), are on a pane's face: ``(n, 3)``."""
    surface = app.surface(pane)
    corners = surface.vertices[surface.triangles[np.asarray(triangles, dtype=np.int64)]]
    return np.einsum("nk,nkd->nd", np.asarray(weights, dtype=np.float64), corners.astype(np.float64))
