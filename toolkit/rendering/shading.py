"""What the surface is made of and how it is lit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["BONE", "CLAY", "IVORY", "SKIN", "Lighting", "Material", "encode_pixels", "encode_srgb", "linear_rgb"]

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """A matt surface with a little gloss.

    ``albedo`` linear RGB, ``gloss`` strength of the highlight, ``sharpness`` its exponent, ``wrap`` how far light of
    each colour creeps round the terminator (skin lets red through).
    """

    albedo: Vector
    gloss: float = 0.14
    sharpness: float = 26.0
    wrap: Vector = (0.10, 0.05, 0.03)


CLAY = Material((0.47, 0.435, 0.40))
SKIN = Material((0.55, 0.40, 0.325), wrap=(0.12, 0.06, 0.04))
IVORY = Material((0.62, 0.60, 0.57), gloss=0.3, sharpness=60.0, wrap=(0.05, 0.05, 0.05))
BONE = Material((0.405, 0.42, 0.45), wrap=(0.05, 0.05, 0.05))


@dataclass(frozen=True)
class Lighting:
    """Lights that travel with the camera: directions *to* the light as (right, up, toward the viewer).

    The key rakes across the face from above and the side, so that wrinkles in both directions cast a shade; the fill
    opens the other side, the rim draws the outline. ``sky`` light comes from everywhere and is dimmed by occlusion.
    """

    key: Vector = (-0.62, 0.66, 0.42)
    key_strength: float = 3.45
    fill: Vector = (0.85, 0.10, 0.55)
    fill_strength: float = 0.30
    rim: Vector = (0.80, 0.45, -0.55)
    rim_strength: float = 0.9
    sky_strength: float = 0.40
    shadows: bool = True
    occlusion: bool = True
    background_top: Vector = (0.030, 0.032, 0.036)
    background_bottom: Vector = (0.010, 0.0105, 0.012)


def linear_rgb(colors: ArrayLike) -> NDArray[np.float64]:
    """Decode sRGB colours, uint8 or floats in 0..1, to linear light, same shape."""
    values = np.asarray(colors)
    unit = values.astype(np.float64) / (255.0 if values.dtype == np.uint8 else 1.0)
    unit = np.clip(unit, 0.0, 1.0)
    return np.where(unit <= 0.04045, unit / 12.92, ((unit + 0.055) / 1.055) ** 2.4)


def encode_pixels(linear: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Encode linear light in 0..1 as sRGB bytes, same shape; by table, since the power is slow."""
    return _byte_table()[(np.clip(linear, 0, 1) * 65535 + 0.5).astype(np.uint16)]


@lru_cache(maxsize=1)
def _byte_table() -> NDArray[np.uint8]:
    return np.round(255 * encode_srgb(np.arange(65536) / 65535)).astype(np.uint8)


def encode_srgb(linear: ArrayLike) -> NDArray[np.float64]:
    """Encode linear light in 0..1 as sRGB in 0..1, same shape."""
    x = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
