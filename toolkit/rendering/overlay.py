"""Lines and markers on a surface, hidden where the surface hides them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image as PilImage
from PIL import ImageDraw

from toolkit.rendering.camera import Camera

__all__ = ["Lines", "Markers", "draw_overlays", "visible"]

Color = tuple[int, int, int]
_SLACK = 0.01  # of the picture's height where the camera looks: what a point on the surface may seem to lie behind it
_FINE = 3  # the overlay is drawn this much larger and reduced, since Pillow draws without anti-aliasing


@dataclass(frozen=True)
class Lines:
    """A polyline through ``vertices`` (N,) vertex ids, e.g. a feature line; ``width`` in pixels."""

    vertices: Sequence[int] | NDArray[np.integer]
    closed: bool = False
    color: Color = (255, 176, 32)
    width: float = 2.0


@dataclass(frozen=True)
class Markers:
    """Discs at ``vertices`` (N,) vertex ids, e.g. landmarks; ``radius`` in pixels."""

    vertices: Sequence[int] | NDArray[np.integer]
    color: Color = (64, 196, 255)
    radius: float = 3.5


def visible(points: NDArray[np.float64], camera: Camera, nearness: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Mask ``(N,)`` of the points (N, 3) that the surface does not hide.

    ``nearness`` (h, w) is 1 / depth of the nearest surface, 0 where there is none.
    """
    height, width = nearness.shape
    screen = camera.project(points, (width, height))
    x, y = np.floor(screen[:, :2]).astype(np.int64).T
    inside = (screen[:, 2] > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
    seen = np.zeros(len(points), dtype=bool)
    surface = nearness[y[inside], x[inside]].astype(np.float64)
    slack = _SLACK * np.tan(np.radians(camera.fov) / 2) * camera.distance * 2
    seen[inside] = (surface <= 0) | (screen[inside, 2] <= 1 / np.maximum(surface, 1e-30) + slack)
    return seen


def draw_overlays(
    image: NDArray[np.uint8],
    overlays: Sequence[Lines | Markers],
    vertices: NDArray[np.float64],
    camera: Camera,
    nearness: NDArray[np.float32],
) -> NDArray[np.uint8]:
    """Return ``image`` (h, w, 3) with the overlays drawn on it."""
    height, width = image.shape[:2]
    layer = PilImage.new("RGBA", (width * _FINE, height * _FINE), (0, 0, 0, 0))
    pen = ImageDraw.Draw(layer)
    for overlay in overlays:
        ids = np.asarray(overlay.vertices, dtype=np.int64)
        if len(ids) == 0:
            continue
        seen = visible(vertices[ids], camera, nearness)
        flat = camera.project(vertices[ids], (width * _FINE, height * _FINE))[:, :2]
        if isinstance(overlay, Lines):
            _draw_lines(pen, flat, seen, overlay)
        else:
            _draw_markers(pen, flat, seen, overlay)
    small = layer.resize((width, height), PilImage.Resampling.BOX)
    base = PilImage.fromarray(image).convert("RGBA")
    return np.asarray(PilImage.alpha_composite(base, small).convert("RGB"))


def _draw_lines(pen: ImageDraw.ImageDraw, flat: NDArray[np.float64], seen: NDArray[np.bool_], line: Lines) -> None:
    count = len(flat) if line.closed else len(flat) - 1
    for k in range(count):
        after = (k + 1) % len(flat)
        if seen[k] and seen[after]:
            segment = [(float(p[0]), float(p[1])) for p in (flat[k], flat[after])]
            pen.line(segment, fill=(*line.color, 255), width=max(round(line.width * _FINE), 1))


def _draw_markers(
    pen: ImageDraw.ImageDraw, flat: NDArray[np.float64], seen: NDArray[np.bool_], markers: Markers
) -> None:
    r = markers.radius * _FINE
    for (x, y), shown in zip(flat, seen, strict=True):
        if shown:
            pen.ellipse(
                (x - r, y - r, x + r, y + r), fill=(*markers.color, 255), outline=(10, 10, 12, 255), width=_FINE
            )
