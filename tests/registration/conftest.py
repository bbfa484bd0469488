"""A synthetic face: a bulging patch with nose, brows and chin, a mouth slit with a bag behind it, in two topologies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh
from toolkit.registration import Landmarks

MOUTH_Y, MOUTH_HALF = -0.5, 0.4
BAG_ROWS = 7


@dataclass(frozen=True)
class Face:
    mesh: TriangleMesh
    upper: np.ndarray
    lower: np.ndarray
    bag: np.ndarray
    """Mask (V,) of what lies behind the lips."""


def _height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    nose = 0.45 * np.exp(-((x / 0.16) ** 2) - ((y - 0.05) / 0.28) ** 2)
    brows = 0.10 * np.exp(-(((np.abs(x) - 0.4) / 0.25) ** 2) - ((y - 0.5) / 0.1) ** 2)
    chin = 0.16 * np.exp(-((x / 0.3) ** 2) - ((y + 0.95) / 0.15) ** 2)
    lips = 0.10 * np.exp(-((x / 0.45) ** 4) - ((y - MOUTH_Y) / 0.14) ** 2)
    return 0.9 - 0.55 * x**2 - 0.35 * y**2 + nose + brows + chin + lips


def warp(points: np.ndarray) -> np.ndarray:
    """Another person: wider, longer nose, heavier chin; smooth and one to one."""
    x, y, z = points.T
    moved_x = 1.12 * x + 0.06 * np.sin(2 * y) * x
    moved_y = 0.95 * y - 0.05 * np.cos(1.5 * x) * y**2
    moved_z = 1.05 * z + 0.12 * np.exp(-6 * (x**2 + (y - 0.05) ** 2)) - 0.06 * y
    return np.stack([moved_x, moved_y, moved_z], axis=1)


def make_face(columns: int, rows: int, seed: int | None = None) -> Face:
    """Grid of ``columns`` x about ``rows``; with a seed the inner vertices are jittered and diagonals turned."""
    inside = round(columns * MOUTH_HALF)
    outer = (columns - inside) // 2
    x = np.concatenate(
        [
            np.linspace(-1, -MOUTH_HALF, outer + 1)[:-1],
            np.linspace(-MOUTH_HALF, MOUTH_HALF, inside),
            np.linspace(MOUTH_HALF, 1, outer + 1)[1:],
        ]
    )
    below = rows // 3
    y = np.concatenate([np.linspace(-1.2, MOUTH_Y, below + 1), np.linspace(MOUTH_Y, 1.2, rows - below)[1:]])
    n = len(x)
    grid_x, grid_y = np.meshgrid(x, y)
    if seed is not None:
        rng = np.random.default_rng(seed)
        free = np.zeros_like(grid_x, dtype=bool)
        free[1:-1, 1:-1] = True
        free[below] = False
        grid_x[free] += rng.uniform(-0.25, 0.25, free.sum()) * 2 / n
        grid_y[free] += rng.uniform(-0.25, 0.25, free.sum()) * 2.4 / len(y)
    points = np.stack([grid_x.ravel(), grid_y.ravel(), _height(grid_x, grid_y).ravel()], axis=1)
    ids = np.arange(points.shape[0]).reshape(len(y), n)
    lower = ids[below, outer : outer + inside]
    # The upper lip gets vertices of its own between the corners.
    upper = np.concatenate([lower[:1], len(points) + np.arange(inside - 2), lower[-1:]])
    points = np.concatenate([points, points[lower[1:-1]] + [0, 1e-4, 0]])
    above = ids.copy()
    above[below, outer : outer + inside] = upper
    quads = [_quads(ids[: below + 1]), _quads(above[below:])]
    rings = [upper]
    for row in range(1, BAG_ROWS):
        angle = np.pi * row / BAG_ROWS
        ring = len(points) + np.arange(inside - 2)
        away = np.stack([0 * ring, 0.12 * np.cos(angle) + 0 * ring, -0.45 * np.sin(angle) + 0 * ring], axis=1)
        taper = np.sin(np.pi * np.linspace(0, 1, inside))[1:-1, None] ** 0.5
        points = np.concatenate([points, points[lower[1:-1]] + away * taper])
        rings.append(np.concatenate([lower[:1], ring, lower[-1:]]))
    rings.append(lower)
    quads.append(_quads(np.array(rings)[::-1]))
    triangles = _split(np.concatenate(quads), turned=seed is not None)
    bag = np.zeros(len(points), dtype=bool)
    bag[np.concatenate([ring[1:-1] for ring in rings[1:-1]])] = True
    return Face(TriangleMesh(points, triangles.astype(np.int32)), upper, lower, bag)


def _quads(ids: np.ndarray) -> np.ndarray:
    return np.stack([ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]], axis=-1).reshape(-1, 4)


def _split(quads: np.ndarray, turned: bool) -> np.ndarray:
    a, b, c, d = quads.T
    halves = [(b, c, d), (b, d, a)] if turned else [(a, b, c), (a, c, d)]
    triangles = np.concatenate([np.stack(half, axis=1) for half in halves])
    return triangles[
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    ]


PLACES = [
    *[(x, y) for x in (-0.75, -0.4, 0.4, 0.75) for y in (-0.9, -0.1, 0.5, 0.95)],
    *[(0.0, y) for y in (-0.95, -0.7, -0.3, -0.1, 0.05, 0.3, 0.55, 0.95)],
    *[(-0.18, -0.02), (0.18, -0.02), (-0.25, -0.38), (0.25, -0.38), (-0.25, -0.62), (0.25, -0.62)],
]


def landmarks_between(source: Face, target: Face, truth: np.ndarray) -> Landmarks:
    """Picked at places of the skin and at the mouth's corners; the target's vertex is the nearest to the true point."""
    skin_source, skin_target = np.flatnonzero(~source.bag), np.flatnonzero(~target.bag)
    picks = [
        int(skin_source[np.argmin(np.sum((source.mesh.vertices[skin_source, :2] - p) ** 2, axis=1))]) for p in PLACES
    ]
    found = [
        int(skin_target[np.argmin(np.sum((target.mesh.vertices[skin_target] - truth[v]) ** 2, axis=1))]) for v in picks
    ]
    picks += [int(source.upper[0]), int(source.upper[-1])]
    found += [int(target.upper[0]), int(target.upper[-1])]
    return Landmarks.of(picks, found, [f"place {k}" for k in range(len(picks))])


def lines_between(source: Face, target: Face | None) -> list[FeatureLine]:
    sides = (("upper", source.upper, target and target.upper), ("lower", source.lower, target and target.lower))
    return [FeatureLine(f"lip_inner_{side}", False, ids, over) for side, ids, over in sides]


@dataclass(frozen=True)
class Pair:
    source: Face
    target: Face
    truth: np.ndarray
    landmarks: Landmarks
    lines: list[FeatureLine]


@pytest.fixture(scope="session")
def pair() -> Pair:
    """Two persons in two topologies, with the true place of each source vertex."""
    source, other = make_face(61, 70), make_face(52, 63, seed=1)
    target = Face(other.mesh.with_vertices(warp(other.mesh.vertices)), other.upper, other.lower, other.bag)
    truth = warp(source.mesh.vertices)
    return Pair(source, target, truth, landmarks_between(source, target, truth), lines_between(source, target))
