"""Closest points against a slow oracle, borders, and far-away origins."""

from __future__ import annotations

import numpy as np

from toolkit.mesh import TriangleMesh
from toolkit.mesh.closest import closest_weights
from toolkit.registration.surface import Surface


def _slow_distance(points: np.ndarray, mesh: TriangleMesh) -> np.ndarray:
    """Closest of all triangles, one point at a time."""
    corners = mesh.vertices[mesh.triangles]
    places = (np.einsum("nk,nkd->nd", closest_weights(p[None], corners), corners) for p in points)
    return np.array([np.linalg.norm(place - p, axis=1).min() for place, p in zip(places, points, strict=True)])


def test_closest_points_equal_the_slow_search(bump: TriangleMesh) -> None:
    points = np.random.default_rng(0).uniform([-1.3, -1.4, -0.3], [1.3, 1.4, 1.0], (80, 3))
    hits = Surface(bump).closest(points)
    np.testing.assert_allclose(hits.distance, _slow_distance(points, bump), atol=2e-6)
    again = np.einsum("nk,nkd->nd", hits.weights, bump.vertices[bump.triangles[hits.triangles]])
    np.testing.assert_allclose(hits.points, again, atol=1e-12)


def test_points_beyond_the_border_are_said_to_be_on_it(bump: TriangleMesh) -> None:
    hits = Surface(bump).closest(np.array([[2.0, 0.1, 0.0], [0.1, 0.1, 2.0]]))
    assert hits.on_border.tolist() == [True, False]


def test_a_far_origin_costs_no_digits(bump: TriangleMesh) -> None:
    far = bump.with_vertices(bump.vertices + 1e5)
    points = bump.vertices + 0.05
    np.testing.assert_allclose(
        Surface(far).closest(points + 1e5).distance, Surface(bump).closest(points).distance, atol=1e-5
    )


def test_only_the_kept_triangles_are_found(bump: TriangleMesh) -> None:
    kept = np.flatnonzero(bump.vertices[bump.triangles].mean(axis=1)[:, 0] > 0.3)
    hits = Surface(bump, kept).closest(bump.vertices)
    assert np.isin(hits.triangles, kept).all()
