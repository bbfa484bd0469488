from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from toolkit.detail_edit import Curve, DetailTake, Region, ReshapeEdit, drawn, solve_detail_edit, within
from toolkit.errors import InputError

KEY = 30
EVERYTHING = np.arange(61 * 73)


def _line(take: DetailTake, places: list[tuple[float, float]]) -> Curve:
    ids = [int(np.argmin((take.smooth[:, 0] - x) ** 2 + (take.smooth[:, 1] - y) ** 2)) for x, y in places]
    return drawn(take.surface, [take.surface.at_vertex(v) for v in ids])


@pytest.fixture(scope="module")
def edit(take: DetailTake) -> ReshapeEdit:
    """The level wrinkle becomes an arch, lower and farther right."""
    curve = _line(take, [(-0.62, 0.5), (-0.35, 0.5), (-0.08, 0.5)])
    goal = _line(take, [(-0.45, 0.05), (-0.3, 0.2), (-0.15, 0.25), (0.0, 0.22), (0.12, 0.12)])
    return ReshapeEdit(region=within(take.surface, curve, 0.17), frame=KEY, curve=curve, goal=goal)


def test_the_valley_lies_on_the_drawn_curve(take: DetailTake, edit: ReshapeEdit) -> None:
    after = take.changed(solve_detail_edit(edit, take)).dynamic(KEY, KEY, EVERYTHING)[0]
    goal = take.surface.places(edit.goal)
    middle = goal[len(goal) // 5 : -len(goal) // 5]
    directions = np.gradient(goal, axis=0)[len(goal) // 5 : -len(goal) // 5]
    across = np.cross(directions, [0, 0, 1])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    steps = np.linspace(-0.1, 0.1, 41)
    flat = take.smooth[:, :2]
    off = []
    for point, way in zip(middle, across, strict=True):
        probes = (point + steps[:, None] * way)[:, :2]
        away = ((probes[:, None] - flat[None]) ** 2).sum(axis=2)
        weights = np.exp(-away / (2 * 0.02**2))
        profile = (weights @ after[:, 2]) / weights.sum(axis=1)
        off.append(abs(steps[int(np.argmin(profile))]))
    assert max(off) < take.surface.edge()


def test_its_profile_is_that_of_the_wrinkle_it_was(
    take: DetailTake, edit: ReshapeEdit, groove: Callable[..., np.ndarray]
) -> None:
    after = take.changed(solve_detail_edit(edit, take)).dynamic(KEY, KEY, EVERYTHING)[0]
    before = take.unedited(KEY, KEY, EVERYTHING)[0]
    new = take.smooth[:, 1] < 0.33
    assert after[new, 2].min() == pytest.approx(before[:, 2].min(), rel=0.1)
    assert after[new, 2].max() == pytest.approx(before[:, 2].max(), rel=0.15)


def test_the_old_wrinkle_is_gone(take: DetailTake, edit: ReshapeEdit) -> None:
    after = take.changed(solve_detail_edit(edit, take)).dynamic(KEY, KEY, EVERYTHING)[0]
    before = take.unedited(KEY, KEY, EVERYTHING)[0]
    old = np.intersect1d(edit.region.vertices, np.flatnonzero(take.smooth[:, 1] > 0.45))
    assert (after[old] ** 2).sum() < 0.05 * (before[old] ** 2).sum()


def test_drawn_from_the_other_end_it_comes_out_the_same(take: DetailTake, edit: ReshapeEdit) -> None:
    turned = Curve(edit.goal.triangles[::-1], edit.goal.weights[::-1])
    other = ReshapeEdit(region=edit.region, frame=KEY, curve=edit.curve, goal=turned)
    a, b = (take.changed(solve_detail_edit(e, take)).dynamic(KEY, KEY, EVERYTHING) for e in (edit, other))
    assert np.abs(a - b).max() < 0.02 * np.abs(a).max()


def test_on_its_own_curve_a_wrinkle_stays(take: DetailTake, edit: ReshapeEdit) -> None:
    same = ReshapeEdit(region=edit.region, frame=KEY, curve=edit.curve, goal=edit.curve)
    after = take.changed(solve_detail_edit(same, take)).dynamic(KEY, KEY, EVERYTHING)[0]
    before = take.unedited(KEY, KEY, EVERYTHING)[0]
    assert np.abs(after - before).max() < 0.02 * np.abs(before).max()


def test_frames_outside_and_skin_elsewhere_stay(take: DetailTake, edit: ReshapeEdit) -> None:
    change = solve_detail_edit(edit, take)
    before, after = take.unedited(0, 60, EVERYTHING), take.changed(change).dynamic(0, 60, EVERYTHING)
    first, last = change.window
    assert (after[:first] == before[:first]).all()
    assert (after[last + 1 :] == before[last + 1 :]).all()
    elsewhere = np.setdiff1d(EVERYTHING, change.region.vertices)
    assert (after[:, elsewhere] == before[:, elsewhere]).all()
    assert len(elsewhere) > 2000


def test_a_curve_needs_two_points(take: DetailTake, edit: ReshapeEdit) -> None:
    one = Curve(edit.curve.triangles[:1], edit.curve.weights[:1])
    with pytest.raises(InputError, match="at least two points"):
        ReshapeEdit(region=Region.whole([3]), frame=KEY, curve=one, goal=edit.goal)
