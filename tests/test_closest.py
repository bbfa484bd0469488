"""Closest points against dense sampling."""

from __future__ import annotations

import numpy as np

from toolkit.mesh.closest import closest_on_polyline, closest_weights


def test_closest_points_on_a_polyline_against_dense_sampling() -> None:
    rng = np.random.default_rng(0)
    line = np.cumsum(rng.normal(size=(9, 3)), axis=0)
    at = np.linspace(0, 8, 8001)
    dense = np.stack([np.interp(at, np.arange(9), line[:, k]) for k in range(3)], axis=1)
    points = 3 * rng.normal(size=(30, 3))
    found = np.linalg.norm(closest_on_polyline(points, line) - points, axis=1)
    best = np.linalg.norm(dense[None] - points[:, None], axis=2).min(axis=1)
    assert np.all(found <= best + 1e-12)
    np.testing.assert_allclose(found, best, atol=2e-3)


def test_one_triangle_against_dense_sampling() -> None:
    rng = np.random.default_rng(1)
    triangle = rng.normal(size=(1, 3, 3))
    u, v = np.meshgrid(np.linspace(0, 1, 301), np.linspace(0, 1, 301))
    inside = u + v <= 1
    dense = np.stack([1 - u[inside] - v[inside], u[inside], v[inside]], axis=1) @ triangle[0]
    for p in 2 * rng.normal(size=(40, 3)):
        weights = closest_weights(p[None], triangle)[0]
        assert weights.min() >= 0
        assert abs(weights.sum() - 1) < 1e-15
        away = np.linalg.norm(weights @ triangle[0] - p)
        best = np.linalg.norm(dense - p, axis=1).min()
        assert best - 0.01 <= away <= best + 1e-12
