from __future__ import annotations

import numpy as np
import pytest

from viewer.help_card import Group, draw_help
from viewer.layout import Rectangle, arrange

GROUPS = [
    Group("Pose edit", [("g, d, b", "move points, set distances, hold by brush"), ("enter, esc", "commit, give up")]),
    Group("Pointer", [("left drag", "turn the view; with alt in every tool")]),
    Group("Everywhere", [(key, f"what {key} does") for key in "abcdefghijk"]),
    Group("Modes", [(str(k), "a mode") for k in range(1, 8)]),
]


def ink(card: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the words, inside the rim."""
    inside = card[2:-2, 2:-2].astype(int)
    rows, columns = np.nonzero(np.abs(inside - inside[0, 0]).max(axis=2) > 40)
    return rows, columns


@pytest.mark.parametrize("zoom", [1.0, 2.0])
def test_the_card_is_as_large_as_its_words(zoom: float) -> None:
    card = draw_help(GROUPS, (4000, 4000), zoom)
    rows, columns = ink(card)
    free = (rows.min(), card.shape[0] - rows.max(), columns.min(), card.shape[1] - columns.max())
    assert min(free) > 8 * zoom
    assert max(free) < 30 * zoom


@pytest.mark.parametrize("size", [(640, 480), (900, 640), (1400, 860), (3800, 2000)])
@pytest.mark.parametrize("em", [16, 32])
def test_the_card_leaves_the_panel_and_what_plays_the_take_free(size: tuple[int, int], em: int) -> None:
    places = arrange(Rectangle(0, 0, *size), em)
    card = draw_help(GROUPS, places.help.size, em / 16)
    frame = places.help.middle(card.shape[1], card.shape[0])
    assert frame.right <= places.panel.x
    assert frame.bottom <= places.buttons.y
    assert min(frame.x, frame.y) >= 0


def test_a_narrow_room_shrinks_the_type_before_it_cuts_words_off() -> None:
    wide = draw_help(GROUPS, (4000, 4000))
    narrow = draw_help(GROUPS, (wide.shape[1] - 60, 4000))
    assert narrow.shape[1] < wide.shape[1] - 60
    _, columns = ink(narrow)
    assert columns.max() < narrow.shape[1] - 8
