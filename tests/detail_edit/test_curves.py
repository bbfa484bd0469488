from __future__ import annotations

import numpy as np
import pytest

from toolkit.detail_edit import Surface, SurfacePoint, drawn, snapped
from toolkit.detail_edit.ground import Ground
from toolkit.errors import InputError


@pytest.mark.parametrize(("start", "end"), [(20 * 120 + 20, 40 * 120 + 60), (20 * 120 + 20, 65 * 120 + 30)])
def test_the_way_between_two_points_is_the_shortest(
    globe: tuple[Surface, np.ndarray, np.ndarray], start: int, end: int
) -> None:
    ball, _, _ = globe
    curve = drawn(ball, [ball.at_vertex(start), ball.at_vertex(end)])
    places = ball.places(curve)
    a, b = ball.vertices[start], ball.vertices[end]
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).sum() == pytest.approx(np.arccos(a @ b), rel=2e-3)
    aside = places @ (np.cross(a, b) / np.linalg.norm(np.cross(a, b)))
    assert np.abs(aside).max() < 0.3 * ball.edge()
    assert places[0] == pytest.approx(a)
    assert places[-1] == pytest.approx(b)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert steps.max() < ball.edge()


def test_a_curve_goes_through_all_its_points(flat: Surface) -> None:
    points = [SurfacePoint(700, (0.2, 0.3, 0.5)), flat.at_vertex(2000), flat.at_vertex(3500), flat.at_vertex(900)]
    places = flat.places(drawn(flat, points))
    for point in points:
        assert np.linalg.norm(places - flat.place(point), axis=1).min() < 1e-9


def test_points_close_together_make_a_short_curve(flat: Surface) -> None:
    near = [SurfacePoint(700, (0.2, 0.3, 0.5)), SurfacePoint(700, (0.3, 0.3, 0.4))]
    curve = drawn(flat, near)
    assert len(curve) >= 2
    length = np.linalg.norm(np.diff(flat.places(curve), axis=0), axis=1).sum()
    assert length == pytest.approx(np.linalg.norm(flat.place(near[0]) - flat.place(near[1])), rel=1e-6)


def test_places_off_the_surface_are_put_on_it(flat: Surface) -> None:
    wanted = flat.places(drawn(flat, [flat.at_vertex(1000), flat.at_vertex(3000)]))
    points = snapped(flat, wanted + [0, 0, 0.05])
    assert np.array([flat.place(point) for point in points]) == pytest.approx(wanted, abs=1e-9)
    beside = flat.place(snapped(flat, np.array([[1.7, 0.1, 0.3]]))[0])
    assert beside[0] == pytest.approx(1.0, abs=0.01)


def test_parts_that_do_not_hang_together_are_said() -> None:
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    surface = Surface(np.concatenate([triangle, triangle + 5]), np.array([[0, 1, 2], [3, 4, 5]]))
    with pytest.raises(InputError, match="do not hang together"):
        drawn(surface, [surface.at_vertex(0), surface.at_vertex(4)])
    with pytest.raises(InputError, match="at least two points"):
        drawn(surface, [surface.at_vertex(0)])


def test_the_closest_point_of_a_triangle_is_the_closest_of_many() -> None:
    rng = np.random.default_rng(0)
    corners, points = rng.standard_normal((60, 3, 3)), 1.5 * rng.standard_normal((60, 3))
    steps = [(a, b) for a in np.linspace(0, 1, 101) for b in np.linspace(0, 1, 101) if a + b <= 1]
    grid = np.array([(1 - a - b, a, b) for a, b in steps])
    for corner, point in zip(corners, points, strict=True):
        place, _, weights = Ground(Surface(corner, np.array([[0, 1, 2]]))).closest(point[None])
        found, best = np.linalg.norm(place[0] - point), np.linalg.norm(grid @ corner - point, axis=1).min()
        assert best - 0.002 < found <= best + 1e-12
        assert weights.min() > -1e-12
        assert weights.sum() == pytest.approx(1)
