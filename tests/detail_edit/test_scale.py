from __future__ import annotations

import numpy as np
import pytest

from toolkit.detail_edit import (
    DetailChange,
    DetailTake,
    GainEdit,
    Region,
    ScaleEdit,
    banded,
    find_window,
    solve_detail_edit,
    within,
)
from toolkit.detail_edit.surface import as_curve
from toolkit.errors import InputError

KEY = 30
EVERYTHING = np.arange(61 * 73)


def _region(take: DetailTake) -> Region:
    line = np.flatnonzero((np.abs(take.smooth[:, 1] - 0.5) < 0.018) & (np.abs(take.smooth[:, 0] + 0.35) < 0.35))
    return within(take.surface, as_curve([take.surface.at_vertex(int(v)) for v in line]), 0.16)


def _edited(take: DetailTake, change: DetailChange) -> tuple[np.ndarray, np.ndarray]:
    before = take.unedited(0, take.n_frames - 1, EVERYTHING)
    after = before.copy()
    change.apply(after, 0, EVERYTHING)
    return before, after


def _energy(values: np.ndarray, vertices: np.ndarray) -> float:
    return float((values[vertices] ** 2).sum())


def test_removing_takes_the_regions_detail_away_and_touches_nothing_beyond_the_band(take: DetailTake) -> None:
    region = _region(take)
    change = solve_detail_edit(ScaleEdit(region=region, frame=KEY, factor=0.0), take)
    before, after = _edited(take, change)
    assert _energy(after[KEY], region.vertices) < 0.05 * _energy(before[KEY], region.vertices)
    width = 3 * take.surface.edge(region.vertices)
    reach = banded(take.surface, region, width)
    outside = np.setdiff1d(EVERYTHING, reach.vertices)
    assert (after[:, outside] == before[:, outside]).all()


def test_enhancing_doubles_at_the_key_frame_and_fades_to_one(take: DetailTake) -> None:
    region = _region(take)
    change = solve_detail_edit(ScaleEdit(region=region, frame=KEY, factor=2.0), take)
    before, after = _edited(take, change)
    ids = region.vertices
    assert after[KEY][ids] == pytest.approx(2 * before[KEY][ids], abs=1e-9)
    first, last = change.window
    size = np.linalg.norm(before[:, ids], axis=(1, 2))
    factor = np.linalg.norm(after[:, ids], axis=(1, 2)) / size
    assert factor[first] < 1.06
    assert factor[last] < 1.06
    assert (np.diff(factor[first : KEY + 1]) > 0).all()
    assert (np.diff(factor[KEY : last + 1]) < 0).all()


def test_the_ends_of_the_window_show_no_jump_in_speed(take: DetailTake) -> None:
    region = _region(take)
    change = solve_detail_edit(ScaleEdit(region=region, frame=KEY, factor=2.0), take)
    before, after = _edited(take, change)
    first, last = change.window
    jolt = np.abs(np.diff(after[:, region.vertices], n=2, axis=0)).max(axis=(1, 2))
    own = np.abs(np.diff(before[:, region.vertices], n=2, axis=0)).max()
    for end in (first - 1, last + 1):
        assert jolt[end - 2 : end + 1].max() < 1.05 * own


def test_frames_outside_the_window_stay_bit_for_bit(take: DetailTake) -> None:
    change = solve_detail_edit(ScaleEdit(region=_region(take), frame=KEY, factor=2.0, window=(20, 35)), take)
    before, after = _edited(take, change)
    assert change.window == (20, 35)
    assert (after[:20] == before[:20]).all()
    assert (after[36:] == before[36:]).all()
    assert (after[20:36] != before[20:36]).any(axis=(1, 2)).all()


def test_a_factor_of_one_changes_nothing(take: DetailTake) -> None:
    before, after = _edited(take, solve_detail_edit(ScaleEdit(region=_region(take), frame=KEY, factor=1.0), take))
    assert (after == before).all()


def test_a_negative_factor_turns_the_valley_into_a_ridge(take: DetailTake) -> None:
    region = _region(take)
    before, after = _edited(take, solve_detail_edit(ScaleEdit(region=region, frame=KEY, factor=-1.0), take))
    assert after[KEY, region.vertices] == pytest.approx(-before[KEY, region.vertices], abs=1e-9)


def test_the_window_is_where_the_detail_is_a_share_of_the_key_frames(take: DetailTake) -> None:
    first, last = find_window(take, _region(take), KEY)
    course = np.exp(-(((np.arange(61) - KEY) / 9.0) ** 2))
    inside = np.flatnonzero(course >= 0.23)
    assert (first, last) == (inside[0], inside[-1])


def test_at_the_ends_of_the_take_an_edit_need_not_fade(take: DetailTake) -> None:
    region = _region(take)
    change = solve_detail_edit(ScaleEdit(region=region, frame=KEY, factor=0.0, window=(0, 60)), take)
    _, after = _edited(take, change)
    assert (after[:, region.vertices] == 0).all()


def test_static_details_are_edited_alone(take: DetailTake) -> None:
    region = _region(take)
    change = solve_detail_edit(ScaleEdit(region=region, frame=KEY, factor=0.0, details="static"), take)
    before, after = _edited(take, change)
    assert (after == before).all()
    static = take.static.copy()
    change.apply_static(static, EVERYTHING)
    assert (static[region.vertices] == 0).all()
    assert (
        static[np.setdiff1d(EVERYTHING, change.vertices)] == take.static[np.setdiff1d(EVERYTHING, change.vertices)]
    ).all()


def test_blocks_and_single_vertices_are_edited_alike(take: DetailTake) -> None:
    change = solve_detail_edit(ScaleEdit(region=_region(take), frame=KEY, factor=2.5), take)
    _, after = _edited(take, change)
    for start in (0, 25, 55):
        block = take.unedited(start, min(start + 9, 60), EVERYTHING)
        change.apply(block, start, EVERYTHING)
        assert (block == after[start : start + 10]).all()
    some = np.array([4000, 17, 2500, int(change.vertices[3])])
    assert (take.changed(change).dynamic(10, 50, some) == after[10:51, some]).all()


def test_a_gain_weakens_the_whole_take(take: DetailTake) -> None:
    before, after = _edited(take, solve_detail_edit(GainEdit(gains=((0, 0.4),)), take))
    assert np.abs(after - 0.4 * before).max() < 1e-8


def test_a_gain_curve_goes_through_its_points_in_its_region(take: DetailTake) -> None:
    region = _region(take)
    change = solve_detail_edit(GainEdit(gains=((10, 1.0), (30, 0.2), (40, 1.5)), region=region), take)
    before, after = _edited(take, change)
    ids = region.vertices
    for frame, gain in ((0, 1.0), (10, 1.0), (30, 0.2), (40, 1.5), (60, 1.5)):
        assert after[frame, ids] == pytest.approx(gain * before[frame, ids], abs=1e-9)
    outside = np.setdiff1d(EVERYTHING, change.vertices)
    assert (after[:, outside] == before[:, outside]).all()


def test_what_does_not_fit_the_take_is_said(take: DetailTake) -> None:
    region = _region(take)
    bad = [
        (ScaleEdit(region=region, frame=61, factor=0.0), "no frame 61"),
        (ScaleEdit(region=region, frame=30, factor=0.0, window=(31, 40)), "does not fit key frame 30"),
        (ScaleEdit(region=Region.whole([99999]), frame=30, factor=0.0), "no vertex 99999"),
        (ScaleEdit(region=Region.whole([5]), frame=0, factor=0.0), "no motion details"),
    ]
    for edit, message in bad:
        with pytest.raises(InputError, match=message):
            solve_detail_edit(edit, take)
    with pytest.raises(InputError, match="region is empty"):
        ScaleEdit(region=Region.whole([]), frame=3, factor=0.0)
    with pytest.raises(InputError, match="no number"):
        ScaleEdit(region=region, frame=3, factor=np.nan)
