from __future__ import annotations

import numpy as np
import pytest

from toolkit.checks import check_pair, check_sequence
from toolkit.checks.scale import check_scale, unit_guess
from toolkit.errors import InputError
from toolkit.meshio.sequence import FrameSequence


def as_sequence(frames, where="take.npy"):
    frames = np.asarray(frames, dtype=np.float32)
    return FrameSequence(len(frames), frames.shape[1], 30.0, where, lambda a, b: frames[a:b])


def test_a_good_take_passes(take, bump):
    seen = []
    sequence = as_sequence(take)
    assert check_pair(bump, sequence) == []
    assert check_sequence(sequence, bump, progress=lambda what, done, total: seen.append((done, total))) == []
    assert seen[-1] == (40, 40)


def test_a_head_that_turns_and_walks_away_passes(take, bump):
    angle = np.linspace(0, np.pi, len(take))
    turns = np.zeros((len(take), 3, 3))
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angle)
    turns[:, 0, 1], turns[:, 1, 0] = -np.sin(angle), np.sin(angle)
    turns[:, 2, 2] = 1
    moving = np.einsum("tij,tvj->tvi", turns, take) + 20 * angle[:, None, None]
    assert check_pair(bump, as_sequence(moving)) == []
    assert check_sequence(as_sequence(moving), bump) == []


@pytest.mark.parametrize(("frame", "vertex"), [(0, 0), (7, 123), (39, 743)])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_non_finite_coordinates_name_frame_and_vertex(take, bump, frame, vertex, value):
    take[frame, vertex, 1] = value
    (finding,) = check_sequence(as_sequence(take), bump)
    assert (finding.severity, finding.index, finding.where) == ("error", frame, "take.npy")
    assert finding.what == f"frame {frame}: vertex {vertex} has no finite position"


def test_opposite_infinities_are_found_though_their_sum_may_not_say_so(take, bump):
    take[3, 5], take[3, 6], take[11, 0, 0] = np.inf, -np.inf, np.nan
    (finding,) = check_sequence(as_sequence(take), bump)
    assert finding.what == "frame 3: vertex 5 has no finite position, and 1 more; 2 frames are affected"


def test_huge_but_finite_coordinates_are_a_matter_of_size(take, bump):
    take[9] *= 1e30
    (finding,) = check_sequence(as_sequence(take), bump)
    assert "e+30 times the size of the reference" in finding.what


def test_a_frame_in_another_unit_is_named(take, bump):
    take[[5, 6]] *= 100
    (finding,) = check_sequence(as_sequence(take), bump)
    assert (finding.severity, finding.index) == ("error", 5)
    assert finding.what.startswith("frame 5 is 1")
    assert finding.what.endswith("and 1 more")


def test_a_take_in_another_unit_than_its_reference_is_told_as_one_fault(take, bump):
    (finding,) = check_sequence(as_sequence(take / 100), bump)
    assert "metres against centimetres?" in finding.what
    assert "same unit" in finding.remedy


def test_a_lost_frame_is_named(take, bump):
    take[12] = 0
    (finding,) = check_sequence(as_sequence(take), bump)
    assert finding.what == "frame 12: all vertices lie at one point"


def test_a_frame_with_another_vertex_count_becomes_a_finding(take, bump):
    def read(start, stop):
        raise InputError("has 80 vertices, but f0.obj has 744", where="f7.obj", remedy="export again")

    broken = FrameSequence(40, bump.n_vertices, 30.0, "take", read)
    (finding,) = check_sequence(broken, bump)
    assert finding.sentence == "f7.obj: has 80 vertices, but f0.obj has 744; export again."


def test_another_vertex_count_than_the_reference(take, bump):
    (finding,) = check_pair(bump, as_sequence(take[:, :-3]), "neutral.obj")
    assert finding.severity == "error"
    assert f"{bump.n_vertices} vertices" in finding.what
    assert f"{bump.n_vertices - 3}" in finding.what
    assert "neutral.obj" in finding.what
    assert finding.where == "take.npy"


@pytest.mark.parametrize("seed", range(5))
def test_another_vertex_order_is_seen_in_any_unit(take, bump, seed):
    rng = np.random.default_rng(seed)
    shuffled = 10.0 ** rng.uniform(-3, 3) * take[:, rng.permutation(take.shape[1])]
    (finding,) = check_pair(bump, as_sequence(shuffled))
    assert "another order" in finding.what


def test_parts_in_another_order_are_seen(head_with_eyes):
    """The eyeballs exported before the head instead of after it."""
    n = head_with_eyes.n_vertices
    order = np.roll(np.arange(n), 100)
    frames = np.repeat(head_with_eyes.vertices[None, order], 3, axis=0)
    assert [f.severity for f in check_pair(head_with_eyes, as_sequence(frames))] == ["error"]


def test_an_opening_mouth_is_not_another_order(bump):
    """A slit whose sides part by a third of the face stretches some edges manyfold; that is what faces do."""
    frames = np.repeat(bump.vertices[None], 3, axis=0)
    below = bump.vertices[:, 1] < 0
    near = np.abs(bump.vertices[:, 0]) < 0.4
    frames[1:, below & near, 1] -= 0.8
    assert check_pair(bump, as_sequence(frames)) == []


def test_sizes_within_a_unit_are_not_mentioned(ball):
    assert check_scale(ball.vertices, 2.5 * ball.vertices) == []
    assert check_scale(ball.vertices, 0.4 * ball.vertices) == []


@pytest.mark.parametrize(
    ("ratio", "units"),
    [
        (100, "centimetres against metres"),
        (0.01, "metres against centimetres"),
        (1000, "millimetres against metres"),
        (0.1, "centimetres against millimetres"),
        (0.11, "centimetres against millimetres"),
        (25.4, "millimetres against inches"),
    ],
)
def test_units_are_guessed(ball, ratio, units):
    (finding,) = check_scale(ball.vertices, ratio * ball.vertices, "shot.toml")
    assert finding.severity == "info"
    assert units in finding.what


def test_no_unit_is_guessed_from_an_odd_ratio():
    assert unit_guess(5.0) == ""
    assert unit_guess(3.3e6) == ""
