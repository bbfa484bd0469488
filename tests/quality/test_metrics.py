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
    detail_energy,
    detail_error,
    face_parts,
    flipped_triangles,
    jitter,
    motion_error,
    rim_gaps,
    rim_neighbourhood,
    unexplained_trembling,
    unrest,
    unsteadiness,
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
    # The whole rim's mean gap, in each face's own height.
    assert gaps.source_mean == pytest.approx([0.1 * (10 + 2 * 2**0.5) / 7, 0])
    assert gaps.mean[0] == pytest.approx(gaps.source_mean[0])
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


def test_differences_of_a_parabola_and_of_a_shake(bump):
    t = np.arange(8.0)[:, None, None]
    speed = np.linspace(0, 1, bump.n_vertices)[:, None] * np.array([1.0, 0, 0])
    found = unsteadiness(bump.vertices + 0.5 * t**2 * speed)
    np.testing.assert_allclose(found.bend, np.linspace(0, 1, bump.n_vertices), atol=1e-9)
    np.testing.assert_allclose(found.shiver, 0, atol=1e-9)
    shaken = unsteadiness(bump.vertices + (-1.0) ** t * speed)
    np.testing.assert_allclose(shaken.speed, 2 * np.linspace(0, 1, bump.n_vertices), atol=1e-9)
    np.testing.assert_allclose(shaken.shiver, 16 * np.linspace(0, 1, bump.n_vertices), atol=1e-9)
    assert not unsteadiness(bump.vertices[None]).speed.any()


@pytest.fixture(scope="module")
def acted() -> np.ndarray:
    """A take (120, 500, 3) on a ball of size 2: four smooth expressions in different places."""
    rng = np.random.default_rng(7)
    rest = rng.normal(size=(500, 3))
    rest /= np.linalg.norm(rest, axis=1, keepdims=True)
    t = np.linspace(0, 4, 120)
    curves = np.maximum(np.sin(2 * np.pi * np.outer(t, [0.5, 0.8, 1.1, 0.3]) + [0, 1, 2, 3]), 0) ** 3
    places = np.exp(-4 * ((rest[:, None] - rest[[3, 50, 200, 400]]) ** 2).sum(axis=2))
    return rest + 0.1 * np.einsum("tk,vk,vi->tvi", curves, places, rest)


def _beside(source, result, scale=1.0):
    return jitter(unsteadiness(source), unsteadiness(result), scale, source[0], 2.0)


def test_larger_motion_is_not_jitter(acted):
    rest = acted[0]
    larger = 3 * (rest + 1.6 * (acted - rest))
    found = _beside(acted, larger, 3.0)
    assert (found.whole, found.typical, found.worst) == pytest.approx((1, 1, 1), abs=1e-6)
    assert found.bend == pytest.approx(1.6)
    assert found.paced == pytest.approx(1)
    assert unexplained_trembling(acted, larger) == pytest.approx(unexplained_trembling(acted, acted))
    # Nor is more motion here and less there.
    uneven = rest + np.linspace(0.2, 2, 500)[:, None] * (acted - rest)
    assert _beside(acted, uneven).worst == pytest.approx(1, abs=0.1)
    assert _beside(acted, uneven).paced == pytest.approx(1, abs=1e-9)
    assert unexplained_trembling(acted, uneven) < 0.01


def test_noise_on_every_frame_is_jitter(acted):
    noise = np.random.default_rng(0).normal(scale=1e-4 * 2, size=acted.shape)
    found = _beside(acted, acted + noise)
    assert found.whole > 1.2
    assert found.typical > 2
    assert found.paced > 1.01
    assert unexplained_trembling(acted, acted + noise) > 0.5
    assert unexplained_trembling(acted, acted) < 0.01


def test_weights_that_flicker_are_jitter(acted):
    rest, rng = acted[0], np.random.default_rng(1)
    flicker = rest + (1 + 0.05 * rng.normal(size=(len(acted), 1, 1))) * (acted - rest)
    assert _beside(acted, flicker).whole > 1.1
    assert unexplained_trembling(acted, flicker) > 0.3


def test_one_trembling_part_shows_though_the_whole_does_not(acted):
    local = acted.copy()
    part = face_parts(acted[0]) < 8
    local[:, part] += np.random.default_rng(2).normal(scale=3e-5, size=local[:, part].shape)
    found = _beside(acted, local)
    assert found.whole < 1.1
    assert found.worst > 3


def test_a_still_source_allows_no_jitter(acted):
    still = np.repeat(acted[:1], 20, axis=0)
    assert _beside(still, still).whole == 1
    assert _beside(still, acted[:20]).whole == np.inf


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


def test_detail_energy_takes_the_gain():
    details = np.ones((3, 10, 3)) * np.array([0, 1, 2])[:, None, None]
    assert detail_energy(details) == pytest.approx([0, 3**0.5, 2 * 3**0.5])
    assert detail_energy(details, np.full(10, 0.5)) == pytest.approx([0, 0.75**0.5, 3**0.5])
