from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest

from viewer.layout import Rectangle, arrange

SIZES = [(640, 480), (900, 640), (1280, 720), (1500, 920), (3000, 1840)]


def covered(places, size: tuple[int, int]) -> np.ndarray:
    count = np.zeros(size[::-1], int)
    for part in (*places.panes, places.panel, places.buttons, places.times, places.floor):
        count[part.y : part.bottom, part.x : part.right] += 1
    return count


@pytest.mark.parametrize("size", SIZES[1:])
@pytest.mark.parametrize("em", [16, 21.3])
def test_the_parts_cover_the_window_and_do_not_overlap(size: tuple[int, int], em: float) -> None:
    places = arrange(Rectangle(0, 0, *size), em)
    count = covered(places, size)
    assert count.max() == 1
    assert (count == 0).sum() == 2 * places.panes[0].height  # a line between the panes


@pytest.mark.parametrize("size", SIZES)
def test_everything_is_inside_and_of_some_size(size: tuple[int, int]) -> None:
    places = arrange(Rectangle(0, 0, *size), 16)
    for part in (
        *places.panes,
        *places.titles,
        places.legend,
        places.status,
        places.progress,
        places.cancel,
        places.times,
    ):
        assert part.width >= 1
        assert part.height >= 1
        assert 0 <= part.x <= part.right <= size[0]
        assert 0 <= part.y <= part.bottom <= size[1]
    right = places.panes[1]
    assert right.x <= places.legend.x
    assert places.legend.right <= right.right


def test_a_screen_of_twice_the_density_shows_the_same_twice_as_large() -> None:
    once, twice = arrange(Rectangle(0, 0, 1280, 720), 16), arrange(Rectangle(0, 0, 2560, 1440), 32)
    for name in ("legend", "panel", "buttons", "times", "floor", "status", "progress", "cancel"):
        np.testing.assert_allclose(2 * np.array(astuple(getattr(once, name))), astuple(getattr(twice, name)), atol=3)
    for one, other in zip(once.panes, twice.panes, strict=True):
        np.testing.assert_allclose(2 * np.array(astuple(one)), astuple(other), atol=3)
