from __future__ import annotations

import json

import numpy as np
import pytest

from toolkit.detail_edit import (
    Dab,
    Region,
    Surface,
    banded,
    grown,
    painted,
    regions_from_data,
    regions_to_data,
    shrunk,
    within,
)
from toolkit.detail_edit.surface import as_curve
from toolkit.errors import InputError


def _middle(flat: Surface) -> int:
    return int(np.argmin(np.linalg.norm(flat.vertices, axis=1)))


def _radius(flat: Surface) -> np.ndarray:
    return np.linalg.norm(flat.vertices - flat.vertices[_middle(flat)], axis=1)


def test_a_dab_is_round_full_in_the_middle_and_soft_at_its_rim(flat: Surface) -> None:
    region = painted(flat, [Dab(flat.at_vertex(_middle(flat)), 0.4, hardness=0.5)])
    field, r = region.field(flat.n_vertices), _radius(flat)
    assert (field[r < 0.19] == 1).all()
    assert (field[r > 0.41] == 0).all()
    order = np.argsort(r)
    assert (np.diff(field[order]) < 0.02).all()
    assert np.abs(field[(r > 0.29) & (r < 0.31)] - 0.5).max() < 0.1


def test_dabs_add_up_and_erase(flat: Surface) -> None:
    point = flat.at_vertex(_middle(flat))
    half = Dab(point, 0.3, strength=0.4)
    assert painted(flat, [half, half]).weights.max() == pytest.approx(0.8)
    assert painted(flat, [half, half, half]).weights.max() == 1
    assert len(painted(flat, [half, Dab(point, 0.4, hardness=1, erase=True)])) == 0


def test_near_a_curve_is_what_lies_within_the_distance(flat: Surface) -> None:
    ids = np.flatnonzero(np.abs(flat.vertices[:, 1]) < 0.017)
    curve = as_curve([flat.at_vertex(int(v)) for v in ids])
    field = within(flat, curve, 0.2, soft=0.1).field(flat.n_vertices)
    away = np.abs(flat.vertices[:, 1])
    assert (field[away < 0.18] == 1).all()
    assert (field[away > 0.32] == 0).all()


def test_growing_and_shrinking_move_the_border_by_the_distance(flat: Surface) -> None:
    r = _radius(flat)
    disc = Region.whole(np.flatnonzero(r < 0.4))
    larger, smaller = (x.field(flat.n_vertices) > 0 for x in (grown(flat, disc, 0.2), shrunk(flat, disc, 0.2)))
    edge = flat.edge()
    assert larger[r < 0.6 - edge].all()
    assert not larger[r > 0.6 + edge].any()
    assert smaller[r < 0.2 - edge].all()
    assert not smaller[r > 0.2 + 2 * edge].any()


def test_a_soft_border_stays_soft_when_grown(flat: Surface) -> None:
    r = _radius(flat)
    soft = Region.of(np.clip((0.5 - r) / 0.3, 0, 1))
    field = grown(flat, soft, 0.2).field(flat.n_vertices)
    assert np.abs(field - np.clip((0.7 - r) / 0.3, 0, 1)).max() < 0.25


def test_the_band_falls_linearly_outside_and_changes_nothing_inside(flat: Surface) -> None:
    r = _radius(flat)
    disc = Region.whole(np.flatnonzero(r < 0.4))
    field = banded(flat, disc, 0.3).field(flat.n_vertices)
    assert (field[r < 0.4] == 1).all()
    assert np.abs(field - np.clip((0.7 - r) / 0.3, 0, 1)).max() < 1.5 * flat.edge() / 0.3
    assert (field[r > 0.7 + flat.edge()] == 0).all()


def test_a_border_softer_than_the_band_needs_none(flat: Surface) -> None:
    soft = Region.of(np.clip((0.6 - _radius(flat)) / 0.5, 0, 1))
    after = banded(flat, soft, 0.2)
    assert np.abs(after.field(flat.n_vertices) - soft.field(flat.n_vertices)).max() < 0.02


def test_named_regions_come_back_from_json(flat: Surface) -> None:
    regions = {
        "forehead": Region.whole([5, 3, 9]),
        "cheek": painted(flat, [Dab(flat.at_vertex(_middle(flat)), 0.3)]),
    }
    back = regions_from_data(json.loads(json.dumps(regions_to_data(regions))))
    assert list(back) == ["forehead", "cheek"]
    for name, region in regions.items():
        assert (back[name].vertices == region.vertices).all()
        assert (back[name].weights == region.weights).all()


def test_joined_and_without() -> None:
    a, b = Region(np.array([1, 2, 3]), np.array([1.0, 0.5, 0.2])), Region(np.array([2, 4]), np.array([0.7, 1.0]))
    assert a.joined(b).field(5).tolist() == [0, 1, 0.7, 0.2, 1]
    assert a.without(b).field(5) == pytest.approx([0, 1, 0.3, 0.2, 0])


def test_bad_regions_are_refused() -> None:
    with pytest.raises(InputError, match="each named once"):
        Region(np.array([1, 1]), np.ones(2))
    with pytest.raises(InputError, match="from 0 to 1"):
        Region(np.array([1]), np.array([1.5]))
    with pytest.raises(InputError, match="only 5 vertices"):
        Region.whole([7]).field(5)
    with pytest.raises(InputError, match="no table"):
        regions_from_data({"forehead": {}})
