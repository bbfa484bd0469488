"""Light baked into vertex colours.

It does what a shader would, since only positions and colours of a mesh can be replaced while it plays. A raking key
light follows the camera, so that wrinkles cast a shade; a fill and a headlight keep the rest readable; a little gloss.
The light can be turned.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.compiled import njit
from toolkit.rendering import Camera

__all__ = ["CLAY", "SKIN", "Light", "bake", "directions"]

Array = NDArray[Any]

SKIN = (0.80, 0.60, 0.50)
CLAY = (0.66, 0.67, 0.70)
_SOFT = (0.28, 0.08, 0.78, 0.0)


@dataclass(frozen=True)
class Light:
    """The key light's place as seen from the camera: degrees to the right and upwards; ``raking`` 0 flat to 1 hard."""

    azimuth: float = -50.0
    elevation: float = 42.0
    raking: float = 0.8


def directions(light: Light, camera: Camera) -> Array:
    """Unit vectors to the key, the fill and the camera in the mesh's axes, ``(3, 3)`` float32."""
    axes = np.stack(camera.axes())
    a, e = np.radians([light.azimuth, light.elevation])
    key = np.array([np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)])
    fill = np.array([-0.8 * np.sign(np.sin(a) or -1.0), 0.1, 0.6])
    local = np.stack([key, fill / np.linalg.norm(fill), [0.0, 0.0, 1.0]])
    return (local @ axes).astype(np.float32)


def bake(
    vertices: NDArray[np.float32],
    triangles: NDArray[np.int32],
    base: NDArray[np.float32],
    light: Light,
    camera: Camera,
    normals: NDArray[np.float32],
    out: NDArray[np.float32],
    *,
    soft: bool = False,
) -> None:
    """Fill ``out`` (V, 3) with the lit colours.

    ``base`` (V, 3) or (1, 3) colours of the surface in 0..1 as seen under full light; ``normals`` (V, 3) is working
    space and holds the unit normals afterwards. ``soft`` is for colour maps, whose colours must stay readable.
    """
    _normals(vertices, triangles, normals)
    towards = directions(light, camera)
    strengths = np.array(_SOFT if soft else _lights(light.raking), dtype=np.float32)
    eye = np.asarray(camera.position, dtype=np.float32)
    _light(vertices, normals, base, towards, strengths, eye, out)


def _lights(raking: float) -> tuple[float, float, float, float]:
    """Strengths of key, fill, headlight and gloss."""
    return 1.1 * raking, 0.2, 0.5 - 0.3 * raking, 0.12


@njit(cache=True, nogil=True, fastmath=True)
def _normals(vertices: Array, triangles: Array, normals: Array) -> None:
    """Area-weighted normals, not of unit length."""
    normals[:] = 0.0
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        ux, uy, uz = vertices[b, 0] - ax, vertices[b, 1] - ay, vertices[b, 2] - az
        vx, vy, vz = vertices[c, 0] - ax, vertices[c, 1] - ay, vertices[c, 2] - az
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        normals[a, 0] += x
        normals[a, 1] += y
        normals[a, 2] += z
        normals[b, 0] += x
        normals[b, 1] += y
        normals[b, 2] += z
        normals[c, 0] += x
        normals[c, 1] += y
        normals[c, 2] += z


@njit(cache=True, nogil=True, fastmath=True)
def _light(
    vertices: Array, normals: Array, base: Array, towards: Array, strengths: Array, eye: Array, out: Array
) -> None:
    one = len(base) == 1
    for i in range(len(vertices)):
        x, y, z = normals[i, 0], normals[i, 1], normals[i, 2]
        length = np.sqrt(x * x + y * y + z * z)
        scale = np.float32(1.0) / length if length > 0 else np.float32(0.0)
        x, y, z = x * scale, y * scale, z * scale
        normals[i, 0], normals[i, 1], normals[i, 2] = x, y, z
        wx, wy, wz = eye[0] - vertices[i, 0], eye[1] - vertices[i, 1], eye[2] - vertices[i, 2]
        reach = np.float32(1.0) / np.sqrt(wx * wx + wy * wy + wz * wz)
        facing = (x * wx + y * wy + z * wz) * reach
        side = np.float32(1.0)
        if facing < 0:  # the back of the surface: dim, so that a hole is seen as one
            side, x, y, z, facing = np.float32(0.42), -x, -y, -z, -facing
        key = x * towards[0, 0] + y * towards[0, 1] + z * towards[0, 2]
        fill = max(x * towards[1, 0] + y * towards[1, 1] + z * towards[1, 2], np.float32(0.0))
        # Light creeps round the terminator, red the farthest: skin.
        red = max((key + np.float32(0.14)) * np.float32(0.877), np.float32(0.0))
        other = max((key + np.float32(0.04)) * np.float32(0.9615), np.float32(0.0))
        hx, hy, hz = towards[0, 0] + wx * reach, towards[0, 1] + wy * reach, towards[0, 2] + wz * reach
        half = max((x * hx + y * hy + z * hz), np.float32(0.0)) ** 2 / (hx * hx + hy * hy + hz * hz)
        gloss = half * half
        gloss = gloss * gloss
        gloss = gloss * gloss * strengths[3]
        rest = strengths[1] * fill + strengths[2] * (np.float32(0.25) + np.float32(0.75) * facing)
        k = 0 if one else i
        out[i, 0] = min(side * (base[k, 0] * (strengths[0] * red + rest) + gloss), np.float32(1.0))
        out[i, 1] = min(side * (base[k, 1] * (strengths[0] * other + rest) + gloss), np.float32(1.0))
        out[i, 2] = min(side * (base[k, 2] * (strengths[0] * other + rest) + gloss), np.float32(1.0))
