from __future__ import annotations

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.rendering import Camera

SIZE = (400, 500)


@pytest.mark.parametrize("direction", [(0, 0, 1), (1, 0, 1), (0.2, -0.7, 1), (0, 1, 0)])
@pytest.mark.parametrize("fov", [5.0, 22.0, 60.0])
def test_facing_keeps_every_point_in_the_picture_and_wastes_none(direction, fov):
    points = np.random.default_rng(3).normal(size=(200, 3)) * [3, 5, 2] + [100, -40, 7]
    screen = Camera.facing(points, direction, fov=fov, margin=0.05, aspect=0.8).project(points, SIZE)
    share = screen[:, :2] / SIZE
    assert screen[:, 2].min() > 0
    assert share.min() >= 0.05 - 1e-9
    assert share.max() <= 0.95 + 1e-9
    assert min(share.min(), 1 - share.max()) == pytest.approx(0.05, abs=1e-6)


def test_projection_is_upright_and_not_mirrored():
    camera = Camera((0, 0, 10), (0, 0, 0), fov=30)
    centre, right, up, nearer = camera.project([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], SIZE)
    assert centre == pytest.approx([200, 250, 10])
    assert right[0] > centre[0]
    assert right[1] == pytest.approx(centre[1])
    assert up[1] < centre[1]
    assert nearer[2] == pytest.approx(9)
    assert right[0] - centre[0] == pytest.approx(250 / np.tan(np.radians(15)) / 10)


def test_orbit_keeps_the_distance_and_moves_the_camera_to_the_right():
    camera = Camera((0, 0, 10), (1, 2, 3))
    turned = camera.orbited(azimuth=90)
    assert turned.distance == pytest.approx(camera.distance)
    assert np.dot(np.subtract(turned.position, turned.target), camera.axes()[0]) == pytest.approx(camera.distance)
    assert camera.orbited().position == pytest.approx(camera.position)


def test_axes_are_orthonormal_even_when_looking_along_up():
    axes = np.stack(Camera((0, 10, 0), (0, 0, 0)).axes())
    assert axes @ axes.T == pytest.approx(np.eye(3))


def test_points_that_cannot_be_framed_are_refused():
    with pytest.raises(InputError, match="frame 0 points"):
        Camera.facing(np.zeros((0, 3)))
