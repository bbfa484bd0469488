from __future__ import annotations

import numpy as np
import pytest

from toolkit.detail_edit import Curve, Surface, SurfacePoint
from toolkit.errors import InputError


def test_on_flat_ground_the_distance_is_the_straight_one(flat: Surface) -> None:
    point = SurfacePoint(2000, (0.2, 0.3, 0.5))
    distance = flat.distance([point])
    straight = np.linalg.norm(flat.vertices - flat.place(point), axis=1)
    assert np.abs(distance - straight).max() < 2e-3 * straight.max()


def test_on_a_sphere_the_distance_is_the_arc(globe: tuple[Surface, np.ndarray, np.ndarray]) -> None:
    ball, _, _ = globe
    vertex = 30 * 120 + 60
    distance = ball.distance([ball.at_vertex(vertex)])
    arc = np.arccos(np.clip(ball.vertices @ ball.vertices[vertex], -1, 1))
    far = (arc > 0.1) & (arc < 1)
    assert np.abs(distance / np.maximum(arc, 1e-9) - 1)[far].max() < 0.005


def test_distance_to_a_line_is_across_it(globe: tuple[Surface, np.ndarray, np.ndarray]) -> None:
    ball, polar, longitude = globe
    points = [ball.at_vertex(30 * 120 + k) for k in range(10, 110)]
    line = Curve(np.array([p.triangle for p in points]), np.array([p.weights for p in points]))
    distance = ball.distance(line, 0.5)
    beside = np.isfinite(distance) & (longitude > longitude[15]) & (longitude < longitude[105])
    assert np.abs(distance - np.abs(polar - polar[30 * 120]))[beside].max() < 2e-3


def test_a_limit_stops_the_front_and_changes_nothing_within(flat: Surface) -> None:
    near, far = flat.distance([flat.at_vertex(2000)], 0.3), flat.distance([flat.at_vertex(2000)])
    assert (np.isfinite(near) == (far <= 0.3)).all()
    assert (near[np.isfinite(near)] == far[np.isfinite(near)]).all()


def test_distance_goes_round_a_gap_not_across() -> None:
    points = np.array([[x, y, 0.0] for x in range(9) for y in range(9)])
    faces = [[9 * i + j, 9 * i + 9 + j, 9 * i + 10 + j] for i in range(8) for j in range(8)]
    faces += [[9 * i + j, 9 * i + 10 + j, 9 * i + 1 + j] for i in range(8) for j in range(8)]
    triangles = np.array([f for f in faces if not (points[f, 0].mean() > 2.5 and 3 < points[f, 1].mean() < 5)])
    surface = Surface(points, triangles)
    below, above = 9 * 8 + 3, 9 * 8 + 5
    distance = surface.distance([surface.at_vertex(below)])
    assert 10 < distance[above] < 14


def test_what_the_mesh_does_not_have_is_said(flat: Surface) -> None:
    with pytest.raises(InputError, match="there is no vertex 4453"):
        flat.at_vertex(4453)
    with pytest.raises(InputError, match="there is no triangle 99999"):
        flat.distance([SurfacePoint(99999, (1.0, 0.0, 0.0))])
    with pytest.raises(InputError, match="at least one point"):
        flat.distance([])
