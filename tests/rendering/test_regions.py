from __future__ import annotations

import numpy as np
import pytest

from toolkit.rendering.regions import close_up_vertices, face_vertices


@pytest.fixture
def plate() -> np.ndarray:
    """A 21 x 31 grid in the plane z = 0, ids row by row."""
    x, y = np.meshgrid(np.arange(21.0), np.arange(31.0))
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)


def _at(x: int, y: int) -> int:
    return 21 * y + x


def test_a_close_up_is_the_box_of_its_landmarks_made_larger(plate):
    marks = {
        "lip_left": _at(8, 5),
        "lip_right": _at(12, 5),
        "Mouth_Top": _at(10, 7),
        "eye_l": _at(5, 20),
        "eyebrow": _at(5, 25),
    }
    box = plate[close_up_vertices("mouth", plate, marks)]
    assert box[:, 0].min() == 7
    assert box[:, 0].max() == 13
    assert box[:, 1].min() == 5  # 6 - 1.5 = 4.5
    assert box[:, 1].max() == 7
    assert close_up_vertices("eyes", plate, marks) is None  # one, and the brow is no eye


def test_the_face_leaves_the_shoulders_out(plate):
    marks = {f"l{k}": _at(x, y) for k, (x, y) in enumerate([(5, 20), (15, 20), (10, 25), (10, 15), (8, 18), (12, 22)])}
    ids = face_vertices(plate, marks)
    assert set(marks.values()) <= set(ids.tolist())
    assert plate[ids, 1].min() > 12
    assert face_vertices(plate, {"a": 0}) is None
