"""Render a mesh to an image on the CPU, the same everywhere, without a display."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from toolkit.errors import InputError
from toolkit.rendering import kernels
from toolkit.rendering.camera import Camera, triple
from toolkit.rendering.overlay import Lines, Markers, draw_overlays
from toolkit.rendering.samples import Finish, KeyShadow, Surface, shade
from toolkit.rendering.shading import CLAY, Lighting, Material, encode_pixels, linear_rgb

__all__ = ["Renderer"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

_SHADOW_TEXELS = 1024
_SKY_DIRECTIONS = 12


class Renderer:
    """Draws meshes of one connectivity.

    Parameters
    ----------
    triangles : (F, 3) vertex ids, counter-clockwise seen from outside. Back faces are drawn, darker.
    material, lighting : how the surface looks; lights travel with the camera.
    albedo : (V, 3) linear RGB of every vertex in place of the material's, for meshes of several materials
    """

    def __init__(
        self,
        triangles: ArrayLike,
        material: Material = CLAY,
        lighting: Lighting | None = None,
        albedo: NDArray[np.floating] | None = None,
    ) -> None:
        self.triangles = np.ascontiguousarray(triangles, dtype=np.int32)
        if self.triangles.ndim != 2 or self.triangles.shape[1] != 3 or len(self.triangles) == 0:
            raise InputError(f"a renderer needs triangles of shape (F, 3), got {self.triangles.shape}")
        self.material = material
        self.lighting = lighting or Lighting()
        self._albedos = albedo
        self._n_needed = int(self.triangles.max()) + 1

    def render(
        self,
        vertices: ArrayLike,
        camera: Camera,
        size: tuple[int, int] = (480, 600),
        *,
        colors: ArrayLike | None = None,
        shading: str = "auto",
        supersample: int = 2,
        wireframe: float = 0.0,
        overlays: Sequence[Lines | Markers] = (),
    ) -> Image:
        """Return the picture ``(height, width, 3)`` uint8, sRGB.

        Parameters
        ----------
        vertices : (V, 3) positions
        size : (width, height) in pixels
        colors : (V, 3) sRGB colours, uint8 or floats in 0..1, in place of the material's
        shading : ``"full"`` (all lights), ``"soft"`` (gentle, so that a colour map stays readable), ``"none"`` (the
            colours as they are) or ``"auto"``: full without colours, soft with
        supersample : samples along each side of a pixel
        wireframe : width of the triangles' edges in pixels, 0 for none
        overlays : lines and markers on the surface, hidden where the surface hides them
        """
        points = self._checked(vertices)
        lighting = self._lighting(shading, colors is not None)
        samples = (size[0] * supersample, size[1] * supersample)
        screen = _perspective(points, camera, samples)
        nearness, face = kernels.rasterize(screen, self.triangles, *samples)
        in_view = _in_view(screen, samples)
        normals = kernels.smooth_normals(points, self.triangles)
        sky = self._sky(points, normals, in_view, camera, lighting)
        surface = Surface(screen, points, normals, self._albedo(points, colors), sky, self.triangles)
        directions = _to_world(np.array([lighting.key, lighting.fill, lighting.rim]), camera)
        linear = shade(
            face,
            surface,
            self._shadow(points, in_view, directions[0], lighting),
            self._finish(directions, camera, lighting, colors is not None),
            np.array([lighting.background_top, lighting.background_bottom]),
            np.array([wireframe * supersample / 2, 0.01, 0.01, 0.012]),
            supersample,
        )
        image = encode_pixels(linear)
        if overlays:
            image = draw_overlays(image, overlays, points, camera, nearness)
        return image

    def _checked(self, vertices: ArrayLike) -> Array:
        points = np.ascontiguousarray(vertices, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < self._n_needed:
            raise InputError(
                f"the triangles need at least {self._n_needed} vertices of 3 coordinates, got an array {points.shape}"
            )
        bad = ~np.isfinite(points).all(axis=1)
        if bad.any():
            raise InputError(f"vertex {int(np.argmax(bad))} is not finite, {int(bad.sum())} of them in all")
        return points

    def _albedo(self, points: Array, colors: ArrayLike | None) -> Array:
        if colors is None and self._albedos is not None and len(self._albedos) == len(points):
            return np.ascontiguousarray(self._albedos, dtype=np.float64)
        if colors is None:
            return np.tile(np.array(self.material.albedo), (len(points), 1))
        albedo = linear_rgb(colors)
        if albedo.shape != points.shape:
            raise InputError(f"{len(points)} vertices need colours of shape {points.shape}, got {albedo.shape}")
        return np.ascontiguousarray(albedo)

    def _lighting(self, shading: str, coloured: bool) -> Lighting:
        if shading == "auto":
            shading = "soft" if coloured else "full"
        if shading == "full":
            return self.lighting
        if shading == "soft":
            return replace(
                self.lighting,
                key_strength=1.15,
                fill_strength=0.3,
                rim_strength=0.2,
                sky_strength=0.75,
                shadows=False,
            )
        if shading == "none":
            return replace(
                self.lighting, key_strength=0.0, fill_strength=0.0, rim_strength=0.0, sky_strength=0.0, shadows=False
            )
        raise InputError(f"no shading is called {shading!r}", remedy="use auto, full, soft or none")

    def _shadow(self, points: Array, in_view: NDArray[np.bool_], light: Array, lighting: Lighting) -> KeyShadow:
        if not lighting.shadows or lighting.key_strength <= 0:
            return KeyShadow(points, np.zeros((1, 1), np.float32), 0.0)
        coords, extent = kernels.turn_to_light(points, _light_axes(light), in_view, _SHADOW_TEXELS)
        depth, _ = kernels.rasterize(coords, self.triangles, _SHADOW_TEXELS, _SHADOW_TEXELS)
        return KeyShadow(coords, depth, 0.004 * extent)

    def _finish(self, directions: Array, camera: Camera, lighting: Lighting, coloured: bool) -> Finish:
        key, fill, rim = (triple(direction) for direction in directions)
        strengths = (lighting.key_strength, lighting.fill_strength, lighting.rim_strength)
        sharpness = float(self.material.sharpness)
        # A colour map must not glitter.
        gloss = (0.0 if coloured else float(self.material.gloss), sharpness, 0.003 ** (1 / sharpness))
        wrap = triple(self.material.wrap)
        return Finish(key, fill, rim, triple(strengths), triple(camera.position), wrap, gloss)

    def _sky(
        self, points: Array, normals: Array, in_view: NDArray[np.bool_], camera: Camera, lighting: Lighting
    ) -> Array:
        """Light (V,) that reaches every vertex from the sky, dimmed where the face itself is in the way."""
        if lighting.sky_strength <= 0:
            return np.zeros(len(points))
        local = _sky_directions(_SKY_DIRECTIONS)
        weight = 0.6 + 0.4 * local[:, 1]
        weight *= 2 * lighting.sky_strength / weight.sum()
        world = _to_world(local, camera)
        if not lighting.occlusion:
            return np.maximum(normals @ world.T, 0.0) @ weight
        texels = self._sky_texels(points, in_view)
        axes = np.stack([_light_axes(direction) for direction in world])
        return kernels.sky_light(points, normals, axes, weight, in_view, texels, max(0.012, 2.0 / texels))

    def _sky_texels(self, points: Array, in_view: NDArray[np.bool_]) -> int:
        """Width of the sky's maps such that a splat of three texels is wider than an edge of the mesh."""
        some = self.triangles[:: max(len(self.triangles) // 2000, 1)]
        edge = float(np.median(np.linalg.norm(points[some[:, 0]] - points[some[:, 1]], axis=1)))
        extent = float(np.ptp(points[in_view], axis=0).max())
        return int(np.clip(extent / max(1.5 * edge, 1e-12), 24, 224))


def _perspective(points: Array, camera: Camera, samples: tuple[int, int]) -> Array:
    screen = camera.project(points, samples)
    near = 1e-3 * camera.distance
    depth = screen[:, 2]
    screen[:, 2] = np.where(depth > near, 1.0 / np.maximum(depth, near), 0.0)
    return screen


def _in_view(screen: Array, samples: tuple[int, int]) -> NDArray[np.bool_]:
    inside = (screen[:, 2] > 0) & (screen[:, 0] > 0) & (screen[:, 1] > 0)
    inside &= (screen[:, 0] < samples[0]) & (screen[:, 1] < samples[1])
    return inside if inside.any() else np.ones(len(screen), dtype=bool)


def _to_world(local: Array, camera: Camera) -> Array:
    world = local @ np.stack(camera.axes())
    return world / np.linalg.norm(world, axis=1, keepdims=True)


def _light_axes(light: Array) -> Array:
    """Rows (right, up, toward the light) of a frame that looks along ``light`` (3,)."""
    helper = np.array([0.0, 1.0, 0.0]) if abs(light[1]) < 0.9 else np.array([1.0, 0.0, 0.0])
    right = np.cross(helper, light)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(light, right), light])


def _sky_directions(count: int) -> Array:
    """Evenly spread directions (count, 3) over the hemisphere in front of the face, from grazing to straight."""
    k = np.arange(count) + 0.5
    toward, angle = 1 - k / count, np.pi * (1 + 5**0.5) * k
    radius = np.sqrt(1 - toward**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), toward], axis=1)
