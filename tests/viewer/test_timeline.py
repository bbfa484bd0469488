from __future__ import annotations

import numpy as np
import pytest

from viewer.timeline import Drawer, Layout, Timeline, at


@pytest.mark.parametrize("scale", [1.0, 2.0])
@pytest.mark.parametrize("n_frames", [1, 2, 186, 5000])
def test_frames_and_pixels_are_inverse(n_frames: int, scale: float) -> None:
    layout = Layout(900, 112, n_frames, scale)
    for frame in {0, n_frames // 3, n_frames - 1}:
        assert layout.frame(layout.x(frame)) == frame
    assert layout.frame(-50) == 0
    assert layout.frame(2000) == n_frames - 1


def test_what_a_press_takes_hold_of() -> None:
    layout = Layout(900, 112, 200)
    strip, below = sum(layout.strip) / 2, layout.ruler[1]
    window = (50, 120)
    assert at(layout, window, layout.x(50) + 3, strip) == ("first", layout.frame(layout.x(50) + 3))
    assert at(layout, window, layout.x(120) - 4, strip)[0] == "last"
    assert at(layout, window, layout.x(80), strip) == ("window", 80)
    assert at(layout, window, layout.x(10), strip) == ("scrub", 10)
    assert at(layout, window, layout.x(80), below) == ("scrub", 80)
    assert at(layout, None, layout.x(80), strip) == ("scrub", 80)


def test_two_handles_on_one_frame_part_by_side() -> None:
    layout = Layout(900, 112, 200)
    strip = sum(layout.strip) / 2
    assert at(layout, (60, 60), layout.x(60) - 2, strip)[0] == "first"
    assert at(layout, (60, 60), layout.x(60) + 2, strip)[0] == "last"


def test_the_playhead_stands_at_its_frame_and_marks_at_theirs() -> None:
    layout = Layout(600, 112, 100)
    marked = np.zeros(100)
    marked[70] = 1.0
    image = Drawer().draw(layout, Timeline(30, 30.0, None, marked)).astype(int)
    assert image.shape == (112, 600, 3)
    column = image[60:, :].sum(axis=0)
    yellow = column[:, 0] + column[:, 1] - 2 * column[:, 2]
    assert abs(int(np.argmax(yellow)) - layout.x(30)) <= 1
    strip = image[int(layout.strip[0]) + 8 : int(layout.strip[1]) - 1].mean(axis=0)
    assert abs(int(np.argmax(strip[400:, 0] - strip[400:, 2])) + 400 - layout.x(70)) <= 4


def test_curves_are_drawn_higher_where_weights_are_larger() -> None:
    layout = Layout(600, 112, 100)
    weights = np.zeros(100)
    weights[50] = 1.0
    image = Drawer().draw(layout, Timeline(0, 30.0, source=weights)).astype(int)
    top = int(layout.curves[0])
    bright = (image[top:].min(axis=2) > 120).argmax(axis=0) + top
    assert bright[round(layout.x(50))] < bright[round(layout.x(30))] - 30


def test_a_gain_is_drawn_to_its_own_scale_with_words() -> None:
    layout = Layout(600, 112, 100)
    gain = np.linspace(0.0, 2.0, 100)
    shown = Timeline(0, 30.0, source=np.full(100, 9.0), gain=gain)
    image = Drawer().draw(layout, shown).astype(int)
    green = (image[:, :, 1] > image[:, :, 0] + 60) & (image[:, :, 1] > image[:, :, 2] + 60)
    rows = [np.flatnonzero(green[int(layout.curves[0]) :, round(layout.x(t))]) for t in (10, 40)]
    top, bottom = layout.curves
    for t, found in zip((10, 40), rows, strict=True):
        wanted = bottom - (bottom - top) * gain[t] / 2 - int(top)
        assert abs(found.mean() - wanted) < 2
    assert green[int(layout.title) : int(top), 400:].any()  # its words


def test_what_is_kept_between_frames_changes_nothing() -> None:
    layout, drawer = Layout(600, 112, 100), Drawer()
    curve = np.sin(np.arange(100.0)) ** 2
    for shown in (
        Timeline(3, 30.0, (5, 9), (), curve, None, "one"),
        Timeline(60, 30.0, (5, 9), (), curve, None, "one"),
        Timeline(60, 30.0, (5, 10), (), curve, None, "one"),
        Timeline(61, 30.0, (5, 10), (), curve, 2 * curve, "one", (4,)),
        Timeline(61, 30.0, (5, 10), (), curve, 2 * curve, "one", (4,), curve),
        Timeline(61, 30.0, (5, 10), (), curve, 2 * curve, "one", (4,), 2 * curve),
    ):
        np.testing.assert_array_equal(drawer.draw(layout, shown), Drawer().draw(layout, shown))
