"""Compiled inner loop that turns what each sample sees into the colours of pixels."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from toolkit.rendering.kernels import _lit

__all__ = ["Lights", "Surface", "shade"]

Array = NDArray[Any]
Weights = tuple[float, float, float]
Corners = tuple[int, int, int]


class Surface(NamedTuple):
    """The mesh as the loop needs it, a row a vertex.

    ``screen`` (V, 3) as in ``kernels``, ``points``, ``normals``, ``albedo`` (V, 3) with linear colours, ``sky`` (V,),
    ``triangles`` (F, 3), ``gloss`` (3,) strength, exponent and the cosine below which a highlight
    is not worth computing, ``wrap`` (3,).
    """

    screen: Array
    points: Array
    normals: Array
    albedo: Array
    sky: Array
    triangles: Array
    gloss: Array
    wrap: Array


class Lights(NamedTuple):
    """``directions`` (3, 3) unit vectors to key, fill and rim, ``strengths`` (3,), ``eye`` (3,) the camera.

    ``coords`` (V, 3), ``depth_map`` (N, N) and ``bias`` are the key's shadow; a map of one texel means none.
    """

    directions: Array
    strengths: Array
    eye: Array
    coords: Array
    depth_map: Array
    bias: float


@njit(cache=True, nogil=True, fastmath=True)
def shade(face: Array, surface: Surface, lights: Lights, background: Array, wire: Array, supersample: int) -> Array:
    """Shade every sample of ``face`` and average each pixel's in linear light: ``(h, w, 3)`` float32 in 0..1.

    ``background`` (2, 3) linear at top and bottom, ``wire`` (4,) line width in samples (0 for none) and its colour.
    Lights with no strength at all mean: show the albedo as it is.
    """
    height, width = face.shape[0] // supersample, face.shape[1] // supersample
    image = np.zeros((height, width, 3), np.float32)
    share = 1.0 / (supersample * supersample)
    lit = lights.strengths.sum() > 0.0
    color = np.empty(3)
    for y in range(height * supersample):
        fade = (y + 0.5) / face.shape[0]
        for x in range(width * supersample):
            f = face[y, x]
            if f < 0:
                for k in range(3):
                    color[k] = background[0, k] * (1 - fade) + background[1, k] * fade
            else:
                corners = (surface.triangles[f, 0], surface.triangles[f, 1], surface.triangles[f, 2])
                weights, front = _barycentric(x + 0.5, y + 0.5, corners, surface.screen)
                for k in range(3):
                    color[k] = _mix(surface.albedo, corners, weights, k)
                if lit:
                    _light(color, corners, weights, front, surface, lights)
                if wire[0] > 0.0:
                    _draw_wire(color, x + 0.5, y + 0.5, corners, surface.screen, wire)
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
def _light(color: Array, corners: Corners, weights: Weights, front: bool, surface: Surface, lights: Lights) -> None:
    """Turn the albedo in ``color`` (3,) into reflected light, in place: wrapped diffuse, highlights and sky."""
    nx, ny, nz = _direction(surface.normals, corners, weights)
    if not front:
        nx, ny, nz = -nx, -ny, -nz
    vx, vy, vz = _to_eye(surface.points, corners, weights, lights.eye)
    inside = 1.0 if front else 0.3
    sky = surface.sky
    ambient = weights[0] * sky[corners[0]] + weights[1] * sky[corners[1]] + weights[2] * sky[corners[2]]
    red = green = blue = ambient * inside
    highlight = 0.0
    for j in range(3):
        lx, ly, lz = lights.directions[j, 0], lights.directions[j, 1], lights.directions[j, 2]
        cosine = nx * lx + ny * ly + nz * lz
        strength = lights.strengths[j] * inside
        if j == 0 and cosine > -0.3:
            strength *= _shadow(corners, weights, cosine, lights)
        # Only the key bleeds round its terminator: from behind it would tint the outline.
        bleed = 1.0 if j == 0 else 0.0
        red += strength / np.pi * _wrapped(cosine, bleed * surface.wrap[0])
        green += strength / np.pi * _wrapped(cosine, bleed * surface.wrap[1])
        blue += strength / np.pi * _wrapped(cosine, bleed * surface.wrap[2])
        if j == 1:
            continue  # the fill is large and soft: no highlight of its own
        hx, hy, hz = lx + vx, ly + vy, lz + vz
        mirrored = (nx * hx + ny * hy + nz * hz) / max(np.sqrt(hx * hx + hy * hy + hz * hz), 1e-12)
        if cosine > 0.0 and mirrored > surface.gloss[2]:
            highlight += strength * min(cosine * 4, 1.0) * mirrored ** surface.gloss[1]
    fresnel = 1.0 + 3.0 * (1.0 - max(nx * vx + ny * vy + nz * vz, 0.0)) ** 4
    shine = surface.gloss[0] * highlight * fresnel * 0.25
    color[0] = _shoulder(color[0] * red + shine)
    color[1] = _shoulder(color[1] * green + shine)
    color[2] = _shoulder(color[2] * blue + shine)


@njit(inline="always")
def _direction(normals: Array, corners: Corners, weights: Weights) -> Weights:
    x, y, z = (
        _mix(normals, corners, weights, 0),
        _mix(normals, corners, weights, 1),
        _mix(normals, corners, weights, 2),
    )
    scale = 1.0 / max(np.sqrt(x * x + y * y + z * z), 1e-12)
    return x * scale, y * scale, z * scale


@njit(inline="always")
def _to_eye(points: Array, corners: Corners, weights: Weights, eye: Array) -> Weights:
    x = eye[0] - _mix(points, corners, weights, 0)
    y = eye[1] - _mix(points, corners, weights, 1)
    z = eye[2] - _mix(points, corners, weights, 2)
    scale = 1.0 / max(np.sqrt(x * x + y * y + z * z), 1e-12)
    return x * scale, y * scale, z * scale


@njit(inline="always")
def _shadow(corners: Corners, weights: Weights, cosine: float, lights: Lights) -> float:
    """Share of the key light that arrives; the bias grows where the light grazes."""
    if lights.depth_map.shape[0] < 2:
        return 1.0
    x = _mix(lights.coords, corners, weights, 0)
    y = _mix(lights.coords, corners, weights, 1)
    near = _mix(lights.coords, corners, weights, 2) + lights.bias * min(1.0 / max(cosine, 0.15), 4.0)
    return float(_lit(lights.depth_map, x, y, near, 3))


@njit(inline="always")
def _wrapped(cosine: float, wrap: float) -> float:
    return max((cosine + wrap) / (1.0 + wrap), 0.0)


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
