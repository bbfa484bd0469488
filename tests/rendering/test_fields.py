from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolkit.rendering.fields import coating_fields, motion_field
from toolkit.smoothing import SmoothingFilter, SmoothingParameters


def test_motion_of_a_turned_head_is_zero_but_where_it_moves(sphere):
    rest = sphere[0] * [1, 1.3, 0.8]
    moved = rest.copy()
    patch = rest[:, 1] < -1.1
    moved[patch, 1] -= 0.25
    turn = Rotation.from_euler("xyz", [10, 20, 5], degrees=True)
    field = motion_field(rest, turn.apply(moved) + [3, -2, 1])
    assert field[patch] == pytest.approx(0.25, abs=0.01)
    assert field[~patch].max() < 0.01


def test_the_coating_is_positive_on_a_bump_and_negative_in_a_pit(sphere):
    vertices, triangles = sphere
    bump, pit = int(np.argmax(vertices[:, 2])), int(np.argmax(vertices[:, 0]))
    shape = vertices.copy()
    shape[bump] *= 1.05
    shape[pit] *= 0.95
    _, length, along = coating_fields(
        shape, triangles, SmoothingFilter(triangles, len(vertices), SmoothingParameters())
    )
    assert along[bump] > 0.01
    assert along[pit] < -0.01
    assert set(np.argsort(length)[-2:]) == {bump, pit}
    assert (length >= np.abs(along) - 1e-12).all()
