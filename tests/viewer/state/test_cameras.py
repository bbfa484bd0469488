from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolkit.rigid import Similarity
from viewer.state.cameras import Framing, Viewpoint, pixel_ray

FACE = np.random.default_rng(1).normal(size=(200, 3)) * [0.7, 1.0, 0.8] + [3.0, 150.0, -2.0]
VIEWS = [Viewpoint(), Viewpoint(40.0, -25.0, 2.0, (0.1, -0.05, 0.02)), Viewpoint(-170.0, 60.0)]


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("size", [(640, 480), (501, 803)])
def test_the_ray_of_a_pixel_meets_what_is_projected_there(view: Viewpoint, size: tuple[int, int]) -> None:
    camera = view.camera(Framing.of(FACE))
    flat = camera.project(FACE, size)
    for point, (x, y, depth) in zip(FACE[::20], flat[::20], strict=True):
        origin, direction = pixel_ray(camera, x, y, size)
        assert depth > 0
        along = (point - origin) @ direction
        np.testing.assert_allclose(origin + along * direction, point, atol=1e-6)


def test_linked_panes_show_the_same_of_faces_in_other_units_and_places() -> None:
    pose = Similarity(0.013, Rotation.from_rotvec([1.2, -0.4, 0.3]).as_matrix(), np.array([-4.0, 5.0, 9.0]))
    framing = Framing.of(FACE)
    for view in VIEWS:
        one = view.camera(framing).project(FACE, (600, 500))
        other = view.camera(framing.moved(pose)).project(pose.apply(FACE), (600, 500))
        np.testing.assert_allclose(one[:, :2], other[:, :2], atol=1e-6)


def test_a_pan_moves_the_face_with_the_pointer() -> None:
    framing, size = Framing.of(FACE), (700, 700)
    for view in VIEWS:
        centre = np.asarray(view.camera(framing).target)[None]
        before = view.camera(framing).project(centre, size)[0]
        after = view.panned(0.1, -0.05).camera(framing).project(centre, size)[0]
        assert after[:2] - before[:2] == pytest.approx((70, 35), abs=1e-6)


def test_an_orbit_turns_about_the_target_and_stops_before_the_pole() -> None:
    framing, view = Framing.of(FACE), VIEWS[1]
    turned = view.orbited(0.2, 0.1)
    assert turned.camera(framing).target == pytest.approx(view.camera(framing).target)
    assert turned.camera(framing).distance == pytest.approx(view.camera(framing).distance)
    assert turned.azimuth < view.azimuth
    assert abs(view.orbited(0, -9).elevation) < 90
    # A drag to the right brings the face's right side, at the picture's left, to the front.
    point = np.array([framing.centre]) + [[0, 0, 0.5]]
    x = [v.camera(framing).project(point, (700, 700))[0, 0] for v in (Viewpoint(), Viewpoint().orbited(0.1, 0))]
    assert x[1] > x[0]


def test_zoom_has_limits() -> None:
    assert Viewpoint().zoomed(1).distance < Viewpoint().distance
    assert Viewpoint().zoomed(1e6).distance > 0
    assert np.isfinite(Viewpoint().zoomed(-1e6).distance)
