from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from toolkit.detail_edit import DetailChange, DetailTake, PasteEdit, Region, SurfacePoint, solve_detail_edit
from toolkit.detail_edit.placing import paste_carrier
from toolkit.errors import InputError

KEY = 30
EVERYTHING = np.arange(61 * 73)


def _point(take: DetailTake, x: float, y: float) -> SurfacePoint:
    away = (take.smooth[:, 0] - x) ** 2 + (take.smooth[:, 1] - y) ** 2
    return take.surface.at_vertex(int(np.argmin(away)))


@pytest.fixture(scope="module")
def region(take: DetailTake) -> Region:
    x, y = take.smooth[:, 0] + 0.35, take.smooth[:, 1] - 0.5
    return Region.whole(np.flatnonzero((np.abs(x) < 0.33) & (np.abs(y) < 0.17)))


def _after(take: DetailTake, change: DetailChange) -> np.ndarray:
    return take.changed(change).dynamic(0, take.n_frames - 1, EVERYTHING)


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float((a * b).sum() / np.sqrt((a**2).sum() * (b**2).sum()))


def _in_space(take: DetailTake, details: np.ndarray) -> np.ndarray:
    return np.einsum("vij,vj->vi", take.frames0, details.astype(np.float64))


def test_mirrored_the_wrinkle_appears_on_the_other_side(
    take: DetailTake, region: Region, groove: Callable[..., np.ndarray]
) -> None:
    edit = PasteEdit(region=region, frame=KEY, start=_point(take, -0.35, 0.5), mirror=True)
    after = _after(take, solve_detail_edit(edit, take))[KEY]
    there = np.abs(take.smooth[:, 0] - 0.35) < 0.4
    mirrored = take.smooth * [-1, 1, 1]
    wanted = 0.02 * groove(mirrored, 0.5, -0.35) * (1 - 0.2 * take.smooth[:, 0])
    assert _correlation(after[there, 2], wanted[there]) > 0.98
    assert np.linalg.norm(after[there, 2]) == pytest.approx(np.linalg.norm(wanted[there]), rel=0.05)
    # What lies in the skin is mirrored, too: here it points along y on both sides.
    flat = _in_space(take, after * [1, 1, 0])[there]
    assert _correlation(flat[:, 1], wanted[there]) > 0.97


def test_turned_and_scaled_it_keeps_its_profile(
    take: DetailTake, region: Region, groove: Callable[..., np.ndarray]
) -> None:
    edit = PasteEdit(
        region=region,
        frame=KEY,
        start=_point(take, -0.35, 0.5),
        goal=_point(take, 0.3, -0.1),
        rotation=90.0,
        scale=1.5,
        strength=0.5,
    )
    change = solve_detail_edit(edit, take)
    after = _after(take, change)[KEY]
    goal = take.surface.place(edit.goal)
    off = (take.smooth - goal) / 1.5
    # Turned by 90 degrees counter-clockwise: what lay along +x lies along +y, what lay along +y along -x.
    back = np.column_stack([off[:, 1] - 0.35, 0.5 - off[:, 0], np.zeros(len(off))])
    wanted = 0.75 * 0.02 * groove(back, 0.5, -0.35) * (1 + 0.2 * back[:, 0])
    near = np.linalg.norm(off[:, :2], axis=1) < 0.3
    assert _correlation(after[near, 2], wanted[near]) > 0.97
    assert np.linalg.norm(after[near, 2]) == pytest.approx(np.linalg.norm(wanted[near]), rel=0.08)
    sideways = _in_space(take, after * [1, 1, 0])[near]
    assert _correlation(-sideways[:, 0], wanted[near]) > 0.95


def test_nothing_changes_but_the_goal_and_its_band(take: DetailTake, region: Region) -> None:
    edit = PasteEdit(region=region, frame=KEY, start=_point(take, -0.35, 0.5), goal=_point(take, 0.4, -0.3))
    change = solve_detail_edit(edit, take)
    before, after = _after(take.changed(), _nothing(change)), _after(take, change)
    touched = (after != before).any(axis=(0, 2))
    assert set(np.flatnonzero(touched)) <= set(change.region.vertices)
    goal = take.surface.place(edit.goal)
    assert np.linalg.norm(take.smooth[touched] - goal, axis=1).max() < 0.55
    outside = np.setdiff1d(np.arange(61), np.arange(change.window[0], change.window[1] + 1))
    assert (after[outside] == before[outside]).all()


def _nothing(change: DetailChange) -> DetailChange:
    return replace(change, activation=np.zeros_like(change.activation), offset=None)


def test_a_pasted_wrinkle_comes_and_goes_with_the_one_it_was_copied_from(take: DetailTake, region: Region) -> None:
    edit = PasteEdit(
        region=region, frame=KEY, start=_point(take, -0.35, 0.5), goal=_point(take, 0.4, -0.3), window=(0, 60)
    )
    after = _after(take, solve_detail_edit(edit, take))
    size = np.linalg.norm(after[:, take.smooth[:, 0] > 0.1], axis=(1, 2))
    course = np.exp(-(((np.arange(61) - KEY) / 9.0) ** 2))
    assert size / size.max() == pytest.approx(course, abs=0.02)


def test_the_same_skin_carries_the_wrinkle_in_every_frame(take: DetailTake, region: Region) -> None:
    edit = PasteEdit(region=region, frame=KEY, start=_point(take, -0.35, 0.5), goal=_point(take, 0.4, -0.3))
    change = solve_detail_edit(edit, take)
    after = _after(take, change)[change.window[0] : change.window[1] + 1, change.region.vertices]
    size = np.linalg.norm(after, axis=(1, 2), keepdims=True)
    assert np.abs(after / size - after[len(after) // 2] / size[len(after) // 2]).max() < 1e-4


@pytest.mark.parametrize("scale", [0.33, 1.0, 2.0])
def test_what_is_taken_adds_up_on_finer_and_on_coarser_meshes(take: DetailTake, region: Region, scale: float) -> None:
    start, goal = _point(take, -0.35, 0.5), _point(take, 0.4, -0.3)
    edit = PasteEdit(region=region, frame=KEY, start=start, goal=goal, scale=scale, rotation=30.0)
    carried = paste_carrier(edit, region, take, take)
    assert np.asarray(carried.up.sum(axis=1)).ravel() == pytest.approx(scale)
    spread = np.diff(carried.up.indptr).max()
    # On a coarser mesh it is a mean over the skin round each vertex, or a narrow wrinkle would turn to beads.
    assert spread > 6 if scale < 0.5 else spread == 3


def test_from_another_frame_and_held(take: DetailTake, region: Region) -> None:
    start, goal = _point(take, -0.35, 0.5), _point(take, 0.4, -0.3)
    there = take.smooth[:, 0] > 0.1
    common = {"region": region, "start": start, "goal": goal, "source_frame": KEY, "frame": 10, "window": (5, 15)}
    follow = _after(take, solve_detail_edit(PasteEdit(**common), take))
    held = _after(take, solve_detail_edit(PasteEdit(**common, hold=True), take))
    at_key = _after(take, solve_detail_edit(PasteEdit(region=region, frame=KEY, start=start, goal=goal), take))[KEY]
    for result in (follow, held):
        assert result[10, there] == pytest.approx(at_key[there], abs=1e-6)
    assert np.linalg.norm(held[12, there]) > np.linalg.norm(follow[12, there])


def test_from_another_shot(take: DetailTake, region: Region) -> None:
    other = replace(take, details=take.details[::-1] * np.float32(2))
    start, goal = _point(take, -0.35, 0.5), _point(take, 0.4, -0.3)
    edit = PasteEdit(region=region, frame=KEY, start=start, goal=goal, source_shot="other")
    there = take.smooth[:, 0] > 0.1
    after = _after(take, solve_detail_edit(edit, take, other))[KEY, there]
    own = _after(take, solve_detail_edit(PasteEdit(region=region, frame=KEY, start=start, goal=goal), take))[KEY, there]
    assert after == pytest.approx(2 * own, abs=1e-6)
    with pytest.raises(InputError, match="was not opened"):
        solve_detail_edit(edit, take)
    cut = replace(take, mesh=replace(take.mesh, triangles=take.mesh.triangles[1:]), shared=type(take.shared)())
    with pytest.raises(InputError, match="another topology"):
        solve_detail_edit(edit, take, cut)


def test_static_details_are_pasted_into_static_ones(take: DetailTake, region: Region) -> None:
    start, goal = _point(take, -0.35, 0.5), _point(take, 0.4, -0.3)
    change = solve_detail_edit(PasteEdit(region=region, frame=0, start=start, goal=goal, details="static"), take)
    static = take.static.copy()
    change.apply_static(static, EVERYTHING)
    full = change.region.vertices[change.region.weights > 0.999]
    assert np.abs(static[full] - take.static[full]).max() > 1e-4
    assert np.abs(static[full]).max() < 0.005
    assert (_after(take, change) == take.unedited(0, 60, EVERYTHING)).all()


def test_added_it_lies_over_what_is_there(take: DetailTake, region: Region) -> None:
    start, goal = _point(take, -0.35, 0.5), _point(take, -0.3, 0.4)
    common = {"region": region, "frame": KEY, "start": start, "goal": goal}
    before = take.unedited(KEY, KEY, EVERYTHING)[0]
    added = _after(take, solve_detail_edit(PasteEdit(**common, add=True), take))[KEY]
    replaced = solve_detail_edit(PasteEdit(**common), take)
    full = replaced.region.vertices[replaced.region.weights > 0.999]
    assert added[full] == pytest.approx((before + _after(take, replaced)[KEY])[full], abs=1e-6)


def test_a_start_away_from_the_region_is_refused(take: DetailTake, region: Region) -> None:
    with pytest.raises(InputError, match="does not lie in the region"):
        solve_detail_edit(PasteEdit(region=region, frame=KEY, start=_point(take, 0.9, -0.9), mirror=True), take)
