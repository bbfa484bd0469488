from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from toolkit.decomposition import frame_neighbours
from toolkit.detail_edit import DetailTake, Surface
from toolkit.mesh import TriangleMesh
from toolkit.mesh.geometry import local_frames

KEY = 30


def net(n: int, m: int) -> np.ndarray:
    """Triangles of a grid of n by m vertices."""
    i, j = np.meshgrid(np.arange(n - 1), np.arange(m - 1), indexing="ij")
    a = (i * m + j).ravel()
    b, c, d = a + m, a + m + 1, a + 1
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)


def sheet(n: int, m: int, height: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """A sheet over [-1, 1] x [-1.2, 1.2], unevenly spaced, domed by ``height``, higher below; normals towards +z."""
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1.2, 1.2, m), indexing="ij"))
    rng = np.random.default_rng(5)
    u, v = u + rng.uniform(-0.1, 0.1, n * m) / n, v + rng.uniform(-0.1, 0.1, n * m) / m
    return np.column_stack([u, v, height * (np.exp(-(u**2) - v**2) + 0.4 * np.exp(-8 * (u**2 + (v + 0.6) ** 2)))]), net(
        n, m
    )


def wrinkle(points: np.ndarray, across: float, along: float, width: float = 0.05) -> np.ndarray:
    """A level groove between two bulges, along x round (along, across), slightly uneven so that it has a left end."""
    y, x = (points[:, 1] - across) / width, points[:, 0] - along
    taper = np.exp(-((x / 0.25) ** 4)) * (1 + 0.8 * x)
    return -taper * (1 - y**2) * np.exp(-(y**2) / 2)


@pytest.fixture(scope="session")
def flat() -> Surface:
    return Surface(*sheet(61, 73))


@pytest.fixture(scope="session")
def grid() -> Callable[[int, int], np.ndarray]:
    return net


@pytest.fixture(scope="session")
def globe() -> tuple[Surface, np.ndarray, np.ndarray]:
    """A part of the unit sphere, 80 by 120 vertices, with the polar angle and the longitude of each."""
    polar, longitude = np.meshgrid(np.linspace(0.4, 2.7, 80), np.linspace(0, 3.5, 120), indexing="ij")
    sine = np.sin(polar)
    points = np.stack([sine * np.cos(longitude), sine * np.sin(longitude), np.cos(polar)], -1).reshape(-1, 3)
    return Surface(points, net(80, 120)), polar.ravel(), longitude.ravel()


@pytest.fixture(scope="session")
def take() -> DetailTake:
    """Sixty-one frames of a domed sheet on which one wrinkle comes and goes round ``KEY``; fine static relief."""
    points, triangles = sheet(61, 73, 0.3)
    neighbour = frame_neighbours(points, triangles)
    frames = local_frames(points, triangles, neighbour)
    rng = np.random.default_rng(1)
    course = np.exp(-(((np.arange(61) - KEY) / 9.0) ** 2))
    details = np.zeros((61, len(points), 3), dtype=np.float32)
    shape = 0.02 * wrinkle(points, 0.5, -0.35)
    details[:, :, 2] = course[:, None] * shape
    sideways = 0.3 * np.column_stack([np.zeros_like(shape), shape, np.zeros_like(shape)])
    local = np.einsum("vji,vj->vi", frames, sideways)
    details[:, :, :2] += (course[:, None, None] * local[:, :2]).astype(np.float32)
    static = 0.001 * rng.standard_normal((len(points), 3))
    gain = 1 + 0.2 * points[:, 0]
    return DetailTake(TriangleMesh(points, triangles), points, neighbour, frames, details, gain, static)


@pytest.fixture(scope="session")
def groove() -> Callable[..., np.ndarray]:
    return wrinkle
