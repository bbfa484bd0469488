"""Each metric on something whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.feature_lines import Opening
from toolkit.mesh import TriangleMesh
from toolkit.quality import (
    coating_energy,
    contact_gaps,
    crossing_triangles,
    detail_error,
    flipped_triangles,
    jitter,
    motion_error,
    rim_gaps,
    rim_neighbourhood,
    second_differences,
    unrest,
)


@pytest.fixture
def mouth() -> tuple[Opening, np.ndarray]:
    """Two rims of nine vertices over a width of 8, sharing their corners, 2 apart."""
    x = np.arange(9.0)
    upper = np.column_stack([x, np.where((x > 0) & (x < 8), 1.0, 0.0), 0 * x])
    lower = np.column_stack([x[1:-1], -np.ones(7), np.zeros(7)])
    opening = Opening("mouth", np.arange(9), np.concatenate([[0], np.arange(9, 16), [8]]))
    return opening, np.concatenate([upper, lower])


def test_gaps_are_distances_from_the_opposite_line(mouth):
    opening, vertices = mouth
    # From (1, 1) the nearest point of the lower line is on its first segment, from (0, 0) to (1, -1).
    expected = np.array([np.sqrt(2), 2, 2, 2, 2, 2, np.sqrt(2)])
    np.testing.assert_allclose(rim_gaps(opening, vertices), np.tile(expected, 2), atol=1e-12)


def test_lids_must_close_where_the_source_does(mouth):
    opening, vertices = mouth
    closed = vertices * [1, 0, 1]
    almost = vertices * [1, 0.1, 1]
    gaps = contact_gaps(opening, [vertices, closed], [2 * vertices, 2 * almost], vertices, 2 * vertices, 10.0, 20.0)
    assert gaps.touching.tolist() == [0, 14]
    assert gaps.closed_frames == 1
    assert gaps.excess[0] == 0
    # 0.2 apart on either side of the closed line, on a face twice as large: 0.4 of 20.
    assert gaps.worst == pytest.approx(0.02)


def test_lips_may_keep_the_gap_that_they_have_at_rest(mouth):
    opening, vertices = mouth
    closed, ajar = vertices * [1, 0, 1], vertices * [1, 0.05, 1]
    gaps = contact_gaps(opening, [closed], [ajar], closed, ajar, 10.0, 10.0)
    assert gaps.worst == 0
    assert gaps.mean[0] > 0
    assert contact_gaps(opening, [closed], [ajar], closed, closed, 10.0, 10.0).worst == pytest.approx(0.01)


def _two_sheets(gap: float) -> TriangleMesh:
    """Two flat squares of two triangles each, the second turned upright and pushed ``gap`` above the first."""
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    upright = np.array([[0.2, 0.6, gap], [0.8, 0.6, gap], [0.8, 0.6, gap + 1], [0.2, 0.6, gap + 1]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], dtype=np.int32)
    return TriangleMesh(np.concatenate([flat, upright]), triangles)


@pytest.mark.parametrize(("gap", "crossing"), [(0.01, 0), (-0.5, 4)])
def test_sheets_cross_where_one_passes_the_other(gap, crossing):
    mesh = _two_sheets(gap)
    assert len(crossing_triangles(mesh.vertices, mesh.triangles)) == crossing


def test_crossings_equal_a_slow_count(bump):
    rng = np.random.default_rng(5)
    vertices = np.repeat(rng.uniform(-1, 1, (30, 3)), 3, axis=0) + rng.uniform(-0.5, 0.5, (90, 3))
    triangles = np.arange(90).reshape(30, 3)
    slow = set()
    for i in range(30):
        for j in range(30):
            if i != j and any(_edge_through(vertices[triangles[i]], vertices[triangles[j]])):
                slow |= {i, j}
    assert 0 < len(slow) < 30
    assert set(crossing_triangles(vertices, triangles).tolist()) == slow
    assert len(crossing_triangles(bump.vertices, bump.triangles)) == 0


def _edge_through(one: np.ndarray, other: np.ndarray) -> list[bool]:
    found = []
    for k in range(3):
        p, q = one[k], one[(k + 1) % 3]
        matrix = np.column_stack([other[1] - other[0], other[2] - other[0], p - q])
        u, v, t = np.linalg.solve(matrix, p - other[0])
        found.append(u > 0 and v > 0 and u + v < 1 and 0 < t < 1)
    return found


def test_neighbourhood_grows_by_rings(bump):
    line = np.array([5 * 31 + 10, 5 * 31 + 11])
    opening = Opening("lid", line, line)
    sizes = [len(rim_neighbourhood(opening, bump.triangles, rings)) for rings in (1, 2, 3)]
    touching = np.isin(bump.triangles, line).any(axis=1)
    assert sizes[0] == np.count_nonzero(touching)
    assert sizes[0] < sizes[1] < sizes[2]


def test_second_differences_of_a_parabola(bump):
    t = np.arange(6.0)[:, None, None]
    speed = np.linspace(0, 1, bump.n_vertices)[:, None] * np.array([1.0, 0, 0])
    frames = bump.vertices + 3 * t + 0.5 * t**2 * speed
    np.testing.assert_allclose(second_differences(frames), np.linspace(0, 1, bump.n_vertices), atol=1e-9)
    assert not second_differences(frames[:2]).any()


def test_jitter_is_measured_in_the_sources_size(take):
    source = second_differences(take)
    assert jitter(source, second_differences(4 * take), 4.0).rms == pytest.approx(1)
    noisy = take + 0.01 * np.random.default_rng(0).normal(size=take.shape)
    assert jitter(source, second_differences(noisy), 1.0).rms > 2


def test_unrest_sees_one_vertex_in_one_frame(bump):
    frames = np.repeat(bump.vertices[None], 5, axis=0)
    assert unrest(frames) == 0
    frames[3, 7] += [0, 0.3, 0.4]
    assert unrest(frames) == pytest.approx(0.5)


def test_motion_error_relative_to_the_motion(take):
    rest = take[0]
    # What stays at rest is wrong by the whole motion; what goes half way, by half of it.
    assert motion_error(np.repeat(rest[None], len(take), axis=0), take, rest).relative == pytest.approx(1)
    assert motion_error(rest + 0.5 * (take - rest), take, rest).relative == pytest.approx(0.5)
    some = np.arange(20)
    wrong = take.copy()
    wrong[:, 30:] += 1
    assert motion_error(wrong, take, rest, some).rms == 0
    assert motion_error(wrong, take, rest).largest == pytest.approx(np.sqrt(3))


def test_detail_error_sees_depth_and_place():
    rng = np.random.default_rng(1)
    true = np.zeros((2000, 3))
    true[:500] = rng.normal(size=(500, 3))
    half = detail_error(0.5 * true, true, 1e-6)
    assert half.correlation == pytest.approx(1)
    assert half.share == 0.25
    assert half.rms == pytest.approx(0.5 * np.sqrt(np.mean(np.sum(true**2, axis=1))))
    assert detail_error(-true, true, 1e-6).correlation == pytest.approx(-1)
    assert abs(detail_error(np.roll(true, 3, axis=0), true, 1e-6).correlation) < 0.2


def test_flips_are_counted_against_the_reference(bump):
    moved = bump.vertices.copy()
    inner = 12 * 31 + 15
    moved[inner, :2] += 2.5 * (bump.vertices[inner + 1, :2] - bump.vertices[inner, :2])
    flipped = flipped_triangles(bump.vertices, moved, bump.triangles)
    assert 0 < len(flipped) < 7
    assert np.all((bump.triangles[flipped] == inner).any(axis=1))
    assert len(flipped_triangles(bump.vertices, 3 * bump.vertices + 1, bump.triangles)) == 0


def test_coating_energy_of_a_smooth_surface_is_nothing(bump):
    assert coating_energy(bump.vertices, bump.vertices, bump.triangles) == 0
    rough = bump.vertices + 0.01 * np.random.default_rng(2).normal(size=bump.vertices.shape)
    assert coating_energy(rough, bump.vertices, bump.triangles) > 0.005
