"""Compiled inner loop that turns what each sample sees into the colours of pixels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from toolkit.compiled import njit
from toolkit.rendering.kernels import _lit

__all__ = ["Finish", "KeyShadow", "Surface", "shade"]

Array = NDArray[Any]
Weights = tuple[float, float, float]
Vector = tuple[float, float, float]
Corners = tuple[int, int, int]


class Surface(NamedTuple):
    """The mesh as the loop needs it, a row a vertex.

    ``screen`` (V, 3) as in ``kernels``, ``points``, ``normals``, ``albedo`` (V, 3) with linear colours, ``sky`` (V,),
    ``triangles`` (F, 3).
    """

    screen: Array
    points: Array
    normals: Array
    albedo: Array
    sky: Array
    triangles: Array


class KeyShadow(NamedTuple):
    """The key's shadow: ``coords`` (V, 3) in ``depth_map`` (N, N), and the bias; a map of one texel means none."""

    coords: Array
    depth_map: Array
    bias: float


class Finish(NamedTuple):
    """Lights and gloss, scalars only: ``strengths`` of the key, fill and rim in the unit directions to them.

    ``eye`` the camera, ``wrap`` a colour each; ``gloss`` strength, exponent, and the cosine below which a highlight
    is not worth computing.
    """

    key: Vector
    fill: Vector
    rim: Vector
    strengths: Vector
    eye: Vector
    wrap: Vector
    gloss: Vector


@njit(cache=True, nogil=True, fastmath=True)
def shade(
    face: Array, surface: Surface, shadow: KeyShadow, finish: Finish, background: Array, wire: Array, supersample: int
) -> Array:
    """Shade every sample of ``face`` and average each pixel's in linear light: ``(h, w, 3)`` float32 in 0..1.

    ``background`` (2, 3) linear at top and bottom, ``wire`` (4,) line width in samples (0 for none) and its colour.
    Lights with no strength at all mean: show the albedo as it is.
    """
    height, width = face.shape[0] // supersample, face.shape[1] // supersample
    image = np.zeros((height, width, 3), np.float32)
    share = 1.0 / (supersample * supersample)
    lit = finish.strengths[0] + finish.strengths[1] + finish.strengths[2] > 0.0
    color = np.empty(3)
    # Taken out once: an array fetched from a tuple in the loop has its references counted at every sample.
    screen, points, normals, albedo, sky, triangles = surface
    coords, depth_map, bias = shadow
    for y in range(height * supersample):
        fade = (y + 0.5) / face.shape[0]
        for x in range(width * supersample):
            f = face[y, x]
            if f < 0:
                for k in range(3):
                    color[k] = background[0, k] * (1 - fade) + background[1, k] * fade
            else:
                corners = (triangles[f, 0], triangles[f, 1], triangles[f, 2])
                weights, front = _barycentric(x + 0.5, y + 0.5, corners, screen)
                for k in range(3):
                    color[k] = _mix(albedo, corners, weights, k)
                if lit:
                    normal = _unit(_interpolate(normals, corners, weights), 1.0 if front else -1.0)
                    at = _interpolate(points, corners, weights)
                    eye = finish.eye
                    view = _unit((eye[0] - at[0], eye[1] - at[1], eye[2] - at[2]), 1.0)
                    ambient = weights[0] * sky[corners[0]] + weights[1] * sky[corners[1]] + weights[2] * sky[corners[2]]
                    grazing = min(1.0 / max(_dot(normal, finish.key), 0.15), 4.0)
                    clear = _unshadowed(_interpolate(coords, corners, weights), depth_map, bias * grazing)
                    _reflect(color, normal, view, ambient, clear, 1.0 if front else 0.3, finish)
                if wire[0] > 0.0:
                    _draw_wire(color, x + 0.5, y + 0.5, corners, screen, wire)
            for k in range(3):
                image[y // supersample, x // supersample, k] += share * color[k]
    return image


@njit(inline="always")
def _mix(values: Array, corners: Corners, weights: Weights, k: int) -> float:
    return weights[0] * values[corners[0], k] + weights[1] * values[corners[1], k] + weights[2] * values[corners[2], k]


@njit(inline="always")
def _barycentric(x: float, y: float, corners: Corners, screen: Array) -> tuple[Weights, bool]:
    """Weights of the corners at a sample, right in perspective, and whether the triangle faces us."""
    a, b, c = corners
    ax, ay, bx, by, cx, cy = screen[a, 0], screen[a, 1], screen[b, 0], screen[b, 1], screen[c, 0], screen[c, 1]
    u = ((cx - bx) * (y - by) - (cy - by) * (x - bx)) * screen[a, 2]
    v = ((ax - cx) * (y - cy) - (ay - cy) * (x - cx)) * screen[b, 2]
    w = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) * screen[c, 2]
    total = u + v + w
    # y runs downwards, so a counter-clockwise triangle that faces us has a negative area.
    return (u / total, v / total, w / total), total < 0.0


@njit(inline="always")
def _interpolate(values: Array, corners: Corners, weights: Weights) -> Vector:
    return _mix(values, corners, weights, 0), _mix(values, corners, weights, 1), _mix(values, corners, weights, 2)


@njit(inline="always")
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(inline="always")
def _unit(a: Vector, sign: float) -> Vector:
    scale = sign / max(np.sqrt(_dot(a, a)), 1e-12)
    return a[0] * scale, a[1] * scale, a[2] * scale


@njit(inline="always")
def _unshadowed(at: Vector, depth_map: Array, bias: float) -> float:
    """Share of the key light that arrives at a point in its map; the bias should grow where the light grazes."""
    return _lit(depth_map, at[0], at[1], at[2] + bias, 3) if depth_map.shape[0] > 1 else 1.0


@njit(inline="always")
def _reflect(
    color: Array, normal: Vector, view: Vector, ambient: float, clear: float, inside: float, finish: Finish
) -> None:
    """Turn the albedo in ``color`` (3,) into reflected light, in place: wrapped diffuse, highlights and sky.

    ``clear`` is the share of the key that arrives, ``inside`` dims back faces.
    """
    to_key, to_rim = _dot(normal, finish.key), _dot(normal, finish.rim)
    key, rim = finish.strengths[0] * inside * clear, finish.strengths[2] * inside
    soft = finish.strengths[1] * inside * max(_dot(normal, finish.fill), 0.0) + rim * max(to_rim, 0.0)
    even = ambient * inside + soft / np.pi
    # The fill is large and soft: no highlight of its own.
    shine = key * _highlight(normal, view, finish.key, to_key, finish.gloss)
    shine += rim * _highlight(normal, view, finish.rim, to_rim, finish.gloss)
    shine *= 0.25 * finish.gloss[0] * (1.0 + 3.0 * (1.0 - max(_dot(normal, view), 0.0)) ** 4)
    for k in range(3):
        # Only the key bleeds round its terminator: from behind it would tint the outline.
        wrapped = max((to_key + finish.wrap[k]) / ((1.0 + finish.wrap[k]) * np.pi), 0.0)
        color[k] = _shoulder(color[k] * (even + key * wrapped) + shine)


@njit(inline="always")
def _highlight(normal: Vector, view: Vector, light: Vector, cosine: float, gloss: Vector) -> float:
    halfway = _unit((light[0] + view[0], light[1] + view[1], light[2] + view[2]), 1.0)
    mirrored = _dot(normal, halfway)
    return min(cosine * 4, 1.0) * mirrored ** gloss[1] if cosine > 0.0 and mirrored > gloss[2] else 0.0


@njit(inline="always")
def _shoulder(value: float) -> float:
    """Bend what is brighter than 0.8 smoothly towards 1, so that highlights do not clip."""
    return value if value < 0.8 else 0.8 + 0.2 * (1.0 - np.exp(-(value - 0.8) / 0.2))


@njit(inline="always")
def _draw_wire(color: Array, x: float, y: float, corners: Corners, screen: Array, wire: Array) -> None:
    near = np.inf
    for k in range(3):
        a, b = corners[k], corners[(k + 1) % 3]
        dx, dy = screen[b, 0] - screen[a, 0], screen[b, 1] - screen[a, 1]
        away = abs(dx * (y - screen[a, 1]) - dy * (x - screen[a, 0])) / max(np.sqrt(dx * dx + dy * dy), 1e-12)
        near = min(near, away)
    cover = min(max(wire[0] + 0.5 - near, 0.0), 1.0)
    for k in range(3):
        color[k] = color[k] * (1 - cover) + wire[1 + k] * cover
