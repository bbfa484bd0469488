from __future__ import annotations

import numpy as np
import pytest

from toolkit.rendering import Camera
from viewer import overlay
from viewer.state.marks import Curve, Disc, Text

CAMERA = Camera((1.0, 2.0, 12.0), (0.0, 0.3, 0.0))
SIZE = (900, 700)


def test_a_disc_has_its_radius_in_pixels_at_any_distance() -> None:
    for place in ((0.0, 0.0, 0.0), (0.5, 0.2, 6.0)):
        corners, _ = overlay.build([Disc(place, radius=7.0)], CAMERA, SIZE[1])
        flat = CAMERA.project(corners, SIZE)[:, :2]
        middle = CAMERA.project(np.array([place]), SIZE)[0, :2]
        reach = np.hypot(*(flat - middle).T)
        assert np.sort(np.unique(reach.round(1)))[[0, -1]] == pytest.approx([0.0, 8.6], abs=0.15)  # with its rim


def test_a_curve_has_its_width_in_pixels() -> None:
    curve = Curve(np.array([[-1.0, 0, 0], [1.0, 0, 0]]), width=6.0)
    corners, colors = overlay.build([curve], CAMERA, SIZE[1])
    assert corners.shape == colors.shape == (6, 3)
    y = CAMERA.project(corners, SIZE)[:, 1]
    assert np.ptp(y[[0, 5]]) == pytest.approx(6.0, rel=0.05)


def test_all_is_nearer_to_the_camera_than_it_is_marked() -> None:
    marks = [Disc((0.1, 0.2, 0.3)), Curve(np.random.default_rng(0).normal(size=(5, 3)), closed=True)]
    corners, _ = overlay.build(marks, CAMERA, SIZE[1])
    discs = corners[-36 * 3 :]
    eye = np.asarray(CAMERA.position)
    assert (np.linalg.norm(discs - eye, axis=1) < np.linalg.norm(np.array([0.1, 0.2, 0.3]) - eye)).all()
    assert len(corners) == 5 * 6 + 2 * 18 * 3


def test_nothing_to_draw() -> None:
    corners, colors = overlay.build([Text((0, 0, 0), "a"), Curve(np.zeros((1, 3)))], CAMERA, 700)
    assert len(corners) == len(colors) == 0


def test_wires_are_bands_along_the_edges() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    edges = np.array([[0, 1], [1, 2]], np.int32)
    out = np.zeros((8, 3), np.float32)
    overlay.wires(vertices, edges, CAMERA, SIZE[1], out)
    triangles = overlay.wire_triangles(2)
    assert triangles.max() == 7
    flat = CAMERA.project(out, SIZE)[:, :2]
    ends = CAMERA.project(vertices, SIZE)[:, :2]
    for band, (start, end) in zip(flat.reshape(2, 4, 2), edges, strict=True):
        np.testing.assert_allclose((band[0] + band[1]) / 2, ends[start], atol=0.1)
        np.testing.assert_allclose((band[2] + band[3]) / 2, ends[end], atol=0.1)
        assert np.hypot(*(band[0] - band[1])) == pytest.approx(1.0, abs=0.1)
    # Both triangles of a band turn the same way, so the band is not folded.
    areas = [np.linalg.det([flat[b] - flat[a], flat[c] - flat[a]]) for a, b, c in triangles]
    assert areas[0] * areas[1] > 0
    assert areas[2] * areas[3] > 0


def test_words_that_would_cover_others_are_left_out() -> None:
    places = np.array([[100.0, 100.0], [112.0, 104.0], [112.0, 130.0], [130.0, 104.0], [131.0, 104.0]])
    assert overlay.uncrowded(places, 20.0, 13.0) == [0, 2, 3]
    assert overlay.uncrowded(np.zeros((0, 2)), 20.0, 13.0) == []
