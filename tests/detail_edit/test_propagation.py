from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from toolkit.detail_edit import DetailTake, Region, ScaleEdit, propagation, solve_detail_edit
from toolkit.detail_edit.propagation import GradientWeights, propagated, region_laplacian
from toolkit.mesh import TriangleMesh
from toolkit.mesh.topology import unique_edges

KEY = 30
EVERYTHING = np.arange(61 * 73)


def _direct(
    mesh: TriangleMesh,
    vertices: np.ndarray,
    unedited: np.ndarray,
    asked: np.ndarray,
    key: int,
    weights: GradientWeights,
) -> np.ndarray:
    """Eqs. 18-21 as they stand, one row for each term, on the details themselves; ``unedited`` (m, V, 3)."""
    m, n = len(unedited), len(vertices)
    place = {int(v): k for k, v in enumerate(vertices)}
    rows: list[tuple[dict[int, float], np.ndarray, float]] = []
    for k, v in enumerate(vertices):
        rows.append(({key * n + k: 1.0}, asked[k], weights.key))
        for t in (0, m - 1):
            rows.append(({t * n + k: 1.0}, unedited[t, v], weights.ends))
        for t in range(m - 1):
            step = unedited[t + 1, v] - unedited[t, v]
            rows.append(({(t + 1) * n + k: 1.0, t * n + k: -1.0}, step, weights.gradient))
    for i, j in unique_edges(mesh.triangles).tolist():
        for t in range(m):
            slope = unedited[t, j] - unedited[t, i]
            unknown = {}
            for v, sign in ((j, 1.0), (i, -1.0)):
                if v in place:
                    unknown[t * n + place[v]] = sign
                else:
                    slope = slope - sign * unedited[t, v]
            if unknown:
                rows.append((unknown, slope, weights.gradient))
    entries = [(r, c, value * np.sqrt(w)) for r, (unknown, _, w) in enumerate(rows) for c, value in unknown.items()]
    r, c, values = (np.array(x) for x in zip(*entries, strict=True))
    matrix = sp.csc_matrix((values, (r.astype(int), c.astype(int))), shape=(len(rows), m * n))
    right = np.array([np.sqrt(w) * goal for _, goal, w in rows])
    return np.asarray(spsolve(sp.csc_matrix(matrix.T @ matrix), matrix.T @ right)).reshape(m, n, 3)


@pytest.mark.parametrize("weights", [GradientWeights(), GradientWeights(2.0, 0.7, 0.3)])
def test_the_fast_way_equals_the_direct_least_squares(bump: TriangleMesh, weights: GradientWeights) -> None:
    rng = np.random.default_rng(4)
    vertices = np.flatnonzero(np.abs(bump.vertices[:, :2]).max(axis=1) < 0.35)
    unedited = rng.standard_normal((9, bump.n_vertices, 3))
    asked = rng.standard_normal((len(vertices), 3))
    direct = _direct(bump, vertices, unedited, asked, 3, weights)
    laplacian = region_laplacian(bump.triangles, vertices)
    change = propagated(laplacian, asked - unedited[3, vertices], (10, 18), 13, weights)
    assert np.abs(unedited[:, vertices] + change - direct).max() < 1e-8


def test_it_takes_as_many_steps_as_it_needs(bump: TriangleMesh, monkeypatch: pytest.MonkeyPatch) -> None:
    vertices = np.flatnonzero(np.abs(bump.vertices[:, :2]).max(axis=1) < 0.8)
    asked = np.random.default_rng(4).standard_normal((len(vertices), 3))
    case = (region_laplacian(bump.triangles, vertices), asked, (0, 60), 20, GradientWeights())
    change = propagated(*case)
    monkeypatch.setattr(propagation, "_STEPS", 4)
    monkeypatch.setattr(propagation, "_ROOM", 4)
    assert np.abs(propagated(*case) - change).max() < 1e-9
    monkeypatch.setattr(propagation, "_MOST_STEPS", 16)
    assert np.abs(propagated(*case) - change).max() > 1e-5


@pytest.mark.parametrize(("window", "frame"), [((4, 4), 4), ((4, 5), 5), ((0, 30), 0)])
def test_small_windows_and_keys_at_the_end(bump: TriangleMesh, window: tuple[int, int], frame: int) -> None:
    rng = np.random.default_rng(4)
    vertices = np.flatnonzero(np.abs(bump.vertices[:, :2]).max(axis=1) < 0.2)
    unedited = np.zeros((window[1] - window[0] + 1, bump.n_vertices, 3))
    asked = rng.standard_normal((len(vertices), 3))
    direct = _direct(bump, vertices, unedited, asked, frame - window[0], GradientWeights())
    change = propagated(region_laplacian(bump.triangles, vertices), asked, window, frame, GradientWeights())
    assert np.abs(change - direct).max() < 1e-8


def test_no_edit_changes_nothing(bump: TriangleMesh) -> None:
    laplacian = region_laplacian(bump.triangles, np.arange(200, 300))
    assert (propagated(laplacian, np.zeros((100, 3)), (0, 20), 7, GradientWeights()) == 0).all()


def test_one_vertex_alone(bump: TriangleMesh) -> None:
    laplacian = region_laplacian(bump.triangles, np.array([333]))
    change = propagated(laplacian, np.ones((1, 3)), (0, 2), 1, GradientWeights())
    assert 0 < change[0, 0, 0] < change[1, 0, 0] < 1


def test_an_edit_goes_the_papers_way_if_asked(take: DetailTake) -> None:
    region = Region.whole(np.flatnonzero((np.abs(take.smooth[:, :2] - [-0.35, 0.5]) < [0.3, 0.17]).all(axis=1)))
    edit = ScaleEdit(region=region, frame=KEY, factor=2.0, propagation="gradients")
    change = solve_detail_edit(edit, take)
    before, after = take.unedited(0, 60, EVERYTHING), take.changed(change).dynamic(0, 60, EVERYTHING)
    first, last = change.window
    assert (after[:first] == before[:first]).all()
    assert (after[last + 1 :] == before[last + 1 :]).all()
    outside = np.setdiff1d(EVERYTHING, change.vertices)
    assert (after[:, outside] == before[:, outside]).all()
    gained = np.linalg.norm((after - before)[:, region.vertices], axis=(1, 2))
    asked = np.linalg.norm(before[KEY, region.vertices])
    assert 0.7 < gained[KEY] / asked < 1
    ids = region.vertices
    jolts = [np.abs(np.diff(values[:, ids], n=2, axis=0)).max(axis=(1, 2)) for values in (before, after)]
    for end in (first - 1, last + 1):
        assert jolts[1][end - 2 : end + 1].max() < jolts[0].max()
    # The flicker that "follow" is there to avoid: a quarter of the window on, next to nothing is left.
    assert gained[(KEY + last) // 2] < 0.1 * gained[KEY]
