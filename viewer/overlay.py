"""Discs and curves as triangles that face the camera: the same on every renderer, crisp, and of a size in pixels.

They are drawn a little nearer to the camera than they are, so that the surface does not swallow them, but the face
still hides those on its other side.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.compiled import njit
from toolkit.rendering import Camera
from viewer.state.cameras import pixel_size
from viewer.state.marks import Curve, Disc, Mark

__all__ = ["CORNERS", "Triangles", "build", "triangles_for", "uncrowded", "wire_triangles", "wires"]

Array = NDArray[np.float64]
Triangles = tuple[NDArray[np.float32], NDArray[np.float32]]

CORNERS = 3
_SIDES = 18
_LIFT = 0.006  # of the distance to the camera
_RIM = (0.05, 0.05, 0.06)


def build(marks: Sequence[Mark], camera: Camera, height: float) -> Triangles:
    """Corners ``(3 n, 3)`` of n triangles and their colours ``(3 n, 3)``, for a pane ``height`` pixels high."""
    corners: list[Array] = [np.zeros((0, 3))]
    colors: list[Array] = [np.zeros((0, 3))]
    for mark in marks:
        if isinstance(mark, Curve):
            points = _ribbon(mark, camera, height)
            corners.append(points)
            colors.append(np.broadcast_to(np.asarray(mark.color), points.shape))
    discs = [mark for mark in marks if isinstance(mark, Disc)]
    if discs:
        # The rim first, a hair farther away than the disc itself.
        for extra, lift, colored in ((1.6, _LIFT, False), (0.0, 1.25 * _LIFT, True)):
            points = _fans(discs, extra, lift, camera, height)
            each = np.array([mark.color if colored else _RIM for mark in discs])
            corners.append(points.reshape(-1, 3))
            colors.append(np.repeat(each, 3 * _SIDES, axis=0))
    return np.concatenate(corners).astype(np.float32), np.concatenate(colors).astype(np.float32)


def uncrowded(places: Array, width: float, height: float) -> list[int]:
    """Of words at ``places`` (n, 2), all about as large, those that cover none before them, in their order."""
    kept: list[int] = []
    for index, place in enumerate(places):
        apart = np.abs(places[kept] - place)
        if not ((apart[:, 0] < width) & (apart[:, 1] < height)).any():
            kept.append(index)
    return kept


def triangles_for(capacity: int) -> NDArray[np.int32]:
    """Triangles ``(capacity, 3)`` of separate corners."""
    return np.arange(3 * capacity, dtype=np.int32).reshape(-1, 3)


def wire_triangles(n_edges: int) -> NDArray[np.int32]:
    """Triangles ``(2 E, 3)`` of the bands that `wires` lays along E edges."""
    first = 4 * np.arange(n_edges, dtype=np.int32)[:, None]
    return (first + np.array([[0, 1, 2, 0, 2, 3]], dtype=np.int32)).reshape(-1, 3)


def wires(
    vertices: NDArray[np.float32], edges: NDArray[np.int32], camera: Camera, height: float, out: NDArray[np.float32]
) -> None:
    """Fill ``out`` (4 E, 3) with bands one pixel wide along ``edges`` (E, 2), a hair nearer to the camera."""
    eye = np.asarray(camera.position, dtype=np.float32)
    share = np.float32(np.tan(np.radians(camera.fov) / 2) / height)
    _wires(vertices, edges, eye, share, np.float32(_LIFT / 4), out)


@njit(cache=True, nogil=True, fastmath=True)
def _wires(vertices: Any, edges: Any, eye: Any, share: Any, lift: Any, out: Any) -> None:
    ends = np.empty((2, 3), np.float32)
    for e in range(len(edges)):
        for k in range(2):
            for c in range(3):
                place = vertices[edges[e, k], c]
                ends[k, c] = place + lift * (eye[c] - place)
        ux, uy, uz = ends[1, 0] - ends[0, 0], ends[1, 1] - ends[0, 1], ends[1, 2] - ends[0, 2]
        wx, wy, wz = eye[0] - ends[0, 0], eye[1] - ends[0, 1], eye[2] - ends[0, 2]
        reach = np.sqrt(wx * wx + wy * wy + wz * wz)
        x, y, z = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        length = np.sqrt(x * x + y * y + z * z)
        scale = share * reach / length if length > 0 else np.float32(0.0)
        x, y, z = x * scale, y * scale, z * scale
        for k in range(2):
            a, b = 4 * e + 3 * k, 4 * e + 1 + k
            out[a, 0], out[a, 1], out[a, 2] = ends[k, 0] - x, ends[k, 1] - y, ends[k, 2] - z
            out[b, 0], out[b, 1], out[b, 2] = ends[k, 0] + x, ends[k, 1] + y, ends[k, 2] + z


def _fans(discs: Sequence[Disc], extra: float, lift: float, camera: Camera, height: float) -> Array:
    """``(n, sides, 3, 3)`` corners of the discs' triangles."""
    right, above, _ = camera.axes()
    centres = _lifted(np.array([mark.position for mark in discs]), camera, lift)
    radius = pixel_size(camera, centres, height) * (np.array([mark.radius for mark in discs]) + extra)
    angle = 2 * np.pi * np.arange(_SIDES + 1) / _SIDES
    ring = np.cos(angle)[:, None] * right + np.sin(angle)[:, None] * above
    rims = centres[:, None] + radius[:, None, None] * ring
    middle = np.broadcast_to(centres[:, None], (len(discs), _SIDES, 3))
    return np.stack([middle, rims[:, :-1], rims[:, 1:]], axis=2)


def _ribbon(curve: Curve, camera: Camera, height: float) -> Array:
    """Corners ``(6 s, 3)`` of a band along s segments, with corners rounded off by an overlap."""
    points = np.asarray(curve.points, dtype=np.float64).reshape(-1, 3)
    if curve.closed and len(points) > 2:
        points = np.concatenate([points, points[:1]])
    if len(points) < 2:
        return np.zeros((0, 3))
    points = _lifted(points, camera, 0.8 * _LIFT)
    half = 0.5 * curve.width * pixel_size(camera, points, height)
    start, end = points[:-1], points[1:]
    toward = np.asarray(camera.position) - start
    side = np.cross(end - start, toward)
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-300)
    forward = end - start
    forward /= np.maximum(np.linalg.norm(forward, axis=1, keepdims=True), 1e-300)
    # Half a width beyond each end closes the gap at a bend.
    a, b = start - 0.5 * half[:-1, None] * forward, end + 0.5 * half[1:, None] * forward
    wide_a, wide_b = half[:-1, None] * side, half[1:, None] * side
    return np.stack([a - wide_a, b - wide_b, b + wide_b, a - wide_a, b + wide_b, a + wide_a], axis=1).reshape(-1, 3)


def _lifted(points: Array, camera: Camera, share: float) -> Array:
    return points + share * (np.asarray(camera.position) - points)
