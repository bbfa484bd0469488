from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.rendering.extras import Extras
from toolkit.rendering.shading import Material
from toolkit.rendering.takes import View, choose_frames, performance_sheet, performance_video, pictures_of
from toolkit.stabilisation import HeadMotion


@pytest.fixture
def views(sphere):
    """A sphere that grows, and the same one twice as large, lying on its back."""
    vertices, triangles = sphere
    lying = vertices[:, [0, 2, 1]] * [1, -1, 1]
    return [
        View("source", triangles, vertices, 6, lambda t: vertices * (0.5 + 0.1 * t)),
        View("target", triangles, 2 * lying, 6, lambda t: lying * (1 + 0.2 * t), forward=(0, -1, 0), up=(0, 0, 1)),
    ]


def test_frames_are_the_extremes_in_order_of_time():
    features = np.array([0, 0.1, 5, 0.2, -4, 0.1])[:, None]
    assert choose_frames(features, 3) == [0, 2, 4]
    assert choose_frames(features, 99) == [0, 1, 2, 3, 4, 5]
    assert len(set(choose_frames(np.zeros((4, 2)), 3))) == 3


def test_pictures_come_in_order_whatever_the_threads(views):
    camera = views[0].camera(0.8)
    frames = [5, 0, 3, 1, 4, 2, 0, 5]
    covered = [(image.max(axis=2) > 80).sum() for image in pictures_of(views[0], frames, camera, (80, 100), workers=3)]
    assert np.array_equal(np.argsort(np.argsort(covered, kind="stable")), np.argsort(np.argsort(frames, kind="stable")))


def test_a_view_in_its_own_frame_of_reference_looks_the_same(views):
    a, b = (next(iter(pictures_of(v, [4], v.camera(0.8), (80, 100)))) for v in views)
    difference = np.abs(a.astype(int) - b.astype(int))
    assert difference.max() <= 8  # the maps of shadow and sky lie differently
    assert difference.mean() < 0.5


def test_sheet_and_video_have_the_sizes_asked_for(views):
    sheet = performance_sheet(views, [0, 3, 5], width=60, title="t")
    assert sheet.shape[1] > 3 * 60
    assert sheet.shape[0] > 2 * 75
    images = list(performance_video(views, [0, 2, 4], height=100))
    assert [image.shape for image in images] == [(100, 160, 3)] * 3
    assert (images[0] != images[1]).any()


def test_frames_out_of_range_are_named(views):
    with pytest.raises(InputError, match="frame 6 is not in the take, which has 6 frames"):
        performance_sheet(views, [0, 6])
    with pytest.raises(InputError, match="nothing to render"):
        list(performance_video(views, []))


def test_closing_a_video_early_stops_the_work(views):
    drawn = []
    slow = View("s", views[0].triangles, views[0].rest, 200, lambda t: drawn.append(t) or views[0].rest)
    stream = pictures_of(slow, range(200), slow.camera(0.8), (20, 24), workers=2)
    next(stream)
    stream.close()
    assert len(drawn) < 20


def test_extras_are_drawn_in_their_own_colour_and_ride_along(views):
    """A small ball before a large one hides it where it is, and moves with the head."""
    moved = HeadMotion(np.tile(np.eye(3), (6, 1, 1)), np.array([[0.12 * t, 0, 0] for t in range(6)]))
    rest, triangles = views[0].rest, views[0].triangles
    ball = Extras(triangles, 0.3 * rest + [0, 0, 1.2], moved, Material((0.9, 0.0, 0.0)))
    still = replace(views[0], frame=lambda t: rest, extras=ball)
    camera = still.camera(0.8)
    images = [image.astype(int) for image in pictures_of(still, [0, 5], camera, (80, 100))]
    red = [(image[..., 0] > 100) & (image[..., 1] < 40) for image in images]
    places = [np.nonzero(mask)[1].mean() for mask in red]
    assert all(mask.sum() > 100 for mask in red)
    assert places[1] > places[0] + 10
    plain = next(iter(pictures_of(replace(still, extras=None), [0], camera, (80, 100)))).astype(int)
    assert not ((plain[..., 0] > 100) & (plain[..., 1] < 40)).any()
