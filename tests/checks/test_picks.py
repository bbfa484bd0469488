from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from toolkit.checks import check_feature_lines, check_landmarks
from toolkit.mesh import TriangleMesh


@dataclass(frozen=True)
class Line:
    name: str
    vertices: list
    closed: bool = False


def picks(mesh, n=40, seed=0):
    """Names and ids of n landmarks, the same on source and target."""
    ids = np.sort(np.random.default_rng(seed).choice(mesh.n_vertices, n, replace=False))
    return [f"mark{k}" for k in range(n)], ids, ids.copy()


@pytest.mark.parametrize("seed", range(5))
def test_good_landmarks_pass(head, seed):
    names, source, target = picks(head, seed=seed)
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    other = head.with_vertices(50 * (head.vertices + rng.normal(0, 0.05, head.vertices.shape)) @ turn.T + 7)
    assert check_landmarks(names, source, target, head, other, "landmarks.json") == []


@pytest.mark.parametrize("bad", [-1, 10**7])
@pytest.mark.parametrize("side", ["source", "target"])
@pytest.mark.parametrize("place", [0, 39])
def test_ids_out_of_range(head, bad, side, place):
    names, source, target = picks(head)
    (source if side == "source" else target)[place] = bad
    (finding,) = check_landmarks(names, source, target, head, head, "landmarks.json")
    assert (finding.severity, finding.index, finding.where) == ("error", place, "landmarks.json")
    assert f"'mark{place}' is {side} vertex {bad}" in finding.what
    assert str(head.n_vertices - 1) in finding.what


def test_the_vertex_count_itself_is_out_of_range_and_the_last_id_is_not(head):
    names, source, target = picks(head)
    source[-1] = head.n_vertices - 1
    assert check_landmarks(names, source, target, head, head) == []
    source[-1] = head.n_vertices
    assert len(check_landmarks(names, source, target, head, head)) == 1


def test_names_and_vertices_that_are_there_twice(head):
    names, source, target = picks(head)
    source[9], target[12], names[20] = source[4], target[3], names[2]
    sentences = [f.what for f in check_landmarks(names, source, target, head, head)]
    assert any("'mark4' and 'mark9' have the same source vertex" in s for s in sentences)
    assert any("'mark3' and 'mark12' have the same target vertex" in s for s in sentences)
    assert any("the name 'mark2'" in s for s in sentences)


@pytest.mark.parametrize("n", [0, 1, 7])
def test_fewer_than_needed(head, n):
    names, source, target = picks(head, n)
    (finding,) = check_landmarks(names, source, target, head, head)
    assert f"{n} landmarks are given, at least 8 are needed" in finding.what


def test_few_landmarks_are_let_pass_with_advice(head):
    (finding,) = check_landmarks(*picks(head, 12), head, head)
    assert (finding.severity, finding.what) == ("info", "only 12 landmarks are given")


def test_a_landmark_off_the_surface(head):
    loose = TriangleMesh(np.concatenate([head.vertices, [[0, 0, 0.0]]]), head.triangles)
    names, source, target = picks(head)
    source[7] = head.n_vertices
    (finding,) = check_landmarks(names, source, target, loose, head)
    assert "belongs to no face" in finding.what
    assert finding.index == 7


def test_landmarks_on_a_line_or_in_a_plane(bump):
    flat = bump.with_vertices(bump.vertices * [1, 1, 0])
    names, source, target = picks(bump)
    (finding,) = check_landmarks(names, source, target, bump, flat)
    assert finding.what == "the target's landmarks lie in one plane"
    line = bump.with_vertices(bump.vertices * [1, 0, 0])
    assert "on one line" in check_landmarks(names, source, target, line, bump)[0].what


def test_landmarks_at_one_point(head):
    names, source, target = picks(head)
    vertices = head.vertices.copy()
    vertices[source[8]] = vertices[source[31]]
    (finding,) = check_landmarks(names, source, target, head.with_vertices(vertices), head)
    assert "'mark8' and 'mark31' lie at the same point of the source" in finding.what


def test_left_and_right_swapped(head):
    face = head.with_vertices(head.vertices * [0.7, 1, 1.3] + 0.2 * head.vertices[:, [1, 2, 0]] ** 2)
    mirror = replace(face.with_vertices(face.vertices * [1, -1, 1]), triangles=face.triangles[:, ::-1])
    names, source, target = picks(face)
    assert check_landmarks(names, source, target, face, face) == []
    (finding,) = check_landmarks(names, source, target, face, mirror)
    assert "left and right" in finding.what


def test_good_lines_pass(head):
    lines = [Line("edge", [3, 90]), Line("loop", [21, 24, 30, 37], closed=True)]
    assert check_feature_lines(lines, head) == []


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (Line("lip", [4, -2, 9]), "vertex -2 at place 1"),
        (Line("lip", [4, 9, 10**6]), "vertex 1000000 at place 2"),
        (Line("lip", [4]), "has 1 vertices, an open one needs 2"),
        (Line("lip", []), "has 0 vertices"),
        (Line("lip", [4, 9], closed=True), "a closed one needs 3"),
        (Line("lip", [4, 9, 9, 20]), "vertex 9 twice in a row, at place 1"),
        (Line("lip", [4, 9, 20, 4], closed=True), "ends with its first vertex 4"),
    ],
)
def test_bad_lines_are_named(head, line, words):
    (finding,) = check_feature_lines([Line("good", [1, 2]), line], head, "feature_lines.json")
    assert words in finding.what
    assert "'lip'" in finding.what
    assert (finding.severity, finding.index, finding.where) == ("error", 1, "feature_lines.json")


def test_a_loop_that_repeats_its_first_vertex_is_told_how_to_close(head):
    (finding,) = check_feature_lines([Line("lid", [4, 9, 20, 4])], head)
    assert '"closed": true' in finding.remedy


def test_a_line_that_comes_back_on_itself_is_let_pass_with_a_warning(head):
    (finding,) = check_feature_lines([Line("lid", [4, 9, 20, 9])], head)
    assert (finding.severity, finding.what) == ("warning", "feature line 'lid' comes to vertex 9 twice")


def test_a_line_from_one_part_to_another(head_with_eyes):
    (finding,) = check_feature_lines([Line("lid", [0, 5, head_with_eyes.n_vertices - 1])], head_with_eyes)
    assert f"from vertex 5 to {head_with_eyes.n_vertices - 1}, which no edge path joins" in finding.what


def test_two_lines_of_one_name(head):
    (finding,) = check_feature_lines([Line("lid", [0, 5]), Line("lid", [7, 9])], head)
    assert finding.what == "two feature lines have the name 'lid'"
