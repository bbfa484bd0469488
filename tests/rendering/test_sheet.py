from __future__ import annotations

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.rendering import Row, contact_sheet, side_by_side


def _picture(value: int, height: int = 60, width: int = 50) -> np.ndarray:
    return np.full((height, width, 3), value, np.uint8)


def test_every_picture_is_on_the_sheet_in_its_place():
    rows = [Row("source", [_picture(200), _picture(201)]), Row("target", [_picture(202), _picture(203)])]
    sheet = contact_sheet(rows, ["frame 0", "frame 9"], "Title", gap=4)
    places = {v: np.argwhere((sheet == v).all(axis=2)) for v in (200, 201, 202, 203)}
    corners = {v: at.min(axis=0) for v, at in places.items()}
    for v, at in places.items():
        assert tuple(np.ptp(at, axis=0) + 1) == (60, 50), v
    assert corners[200][0] == corners[201][0] < corners[202][0] == corners[203][0]
    assert corners[201][1] - corners[200][1] == 54
    assert corners[202][1] == corners[200][1]
    assert corners[202][0] - corners[200][0] == 64


def test_rows_may_differ_in_height():
    sheet = contact_sheet([Row("", [_picture(200)]), Row("", [_picture(201, height=20)])], gap=0)
    assert sheet.shape == (80, 50, 3)


def test_labels_are_drawn():
    pictures = [Row("", [_picture(0)])]
    assert contact_sheet(pictures, title="x").max() > 150
    assert contact_sheet(pictures).max() < 50
    labelled = side_by_side([_picture(0, 200, 300)], ["source"])
    assert labelled[:160].max() == 0
    assert labelled[160:].max() > 150


def test_side_by_side_keeps_order_and_size():
    joined = side_by_side([_picture(10, width=30), _picture(20)])
    assert joined.shape == (60, 80, 3)
    assert joined[0, 29, 0] == 10
    assert joined[0, 30, 0] == 20


def test_uneven_input_is_refused():
    with pytest.raises(InputError, match="'b' has 1 pictures, the first row has 2"):
        contact_sheet([Row("a", [_picture(0)] * 2), Row("b", [_picture(0)])])
    with pytest.raises(InputError, match="not all of one size"):
        contact_sheet([Row("a", [_picture(0), _picture(0, 10)])])
    with pytest.raises(InputError, match="at least one row"):
        contact_sheet([])
    with pytest.raises(InputError, match="one height"):
        side_by_side([_picture(0), _picture(0, 10)])
