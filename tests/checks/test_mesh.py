from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolkit.checks import check_mesh, raise_for
from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh


def only(findings, word):
    """The one finding that says ``word``; there must be no other but information."""
    assert [word in f.what for f in findings if f.severity != "info" or word in f.what] == [True], findings
    return next(f for f in findings if word in f.what)


def with_faces(mesh, *faces):
    return replace(mesh, triangles=np.concatenate([mesh.triangles, np.array(faces, dtype=np.int32)]))


@pytest.mark.parametrize("name", ["ball", "head", "bump"])
def test_a_good_mesh_is_let_pass_in_silence(name, request):
    assert check_mesh(request.getfixturevalue(name), "good.obj") == []


@pytest.mark.parametrize("seed", range(6))
def test_a_good_mesh_passes_wherever_and_however_it_stands(head, seed):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    size = 10.0 ** rng.uniform(-4, 4)
    order = rng.permutation(head.n_vertices)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    vertices = size * (head.vertices @ turn.T + rng.normal(size=3))
    faces = np.stack([np.roll(f, k) for f, k in zip(head.triangles, rng.integers(0, 3, head.n_triangles), strict=True)])
    shuffled = TriangleMesh(vertices[order], place[faces][rng.permutation(len(faces))].astype(np.int32))
    assert check_mesh(shuffled) == []


def test_several_parts_are_information_and_their_winding_is_left_alone(head_with_eyes):
    (finding,) = check_mesh(head_with_eyes, "head.ply")
    assert finding.severity == "info"
    assert "4 separate parts" in finding.what
    assert finding.where == "head.ply"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_non_finite_coordinates_name_the_vertex(ball, value):
    vertices = ball.vertices.copy()
    vertices[17, 1] = value
    vertices[40] = value
    finding = only(check_mesh(ball.with_vertices(vertices), "a.obj"), "not finite, and 1 more")
    assert (finding.severity, finding.index) == ("error", 17)


def test_the_last_vertex_and_face_are_looked_at_too(ball):
    vertices = ball.vertices.copy()
    vertices[-1, 2] = np.nan
    assert only(check_mesh(ball.with_vertices(vertices)), "not finite").index == ball.n_vertices - 1
    triangles = ball.triangles.copy()
    triangles[-1, 2] = ball.n_vertices
    assert only(check_mesh(replace(ball, triangles=triangles)), "ids run from").index == ball.n_triangles - 1


@pytest.mark.parametrize("corner", [0, 1, 2])
@pytest.mark.parametrize("id_", [-1, 10**6])
def test_out_of_range_faces_are_errors_in_every_corner(ball, corner, id_):
    triangles = ball.triangles.copy()
    triangles[5, corner] = id_
    finding = only(check_mesh(replace(ball, triangles=triangles)), f"face 5 uses vertex {id_}")
    assert finding.severity == "error"
    assert str(ball.n_vertices - 1) in finding.what


def test_empty_meshes():
    nothing = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))
    points = TriangleMesh(np.eye(3), np.zeros((0, 3), dtype=np.int32))
    collapsed = TriangleMesh(np.ones((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))
    assert only(check_mesh(nothing), "no vertices").severity == "error"
    assert only(check_mesh(points), "no faces").severity == "error"
    assert only(check_mesh(collapsed), "one point").severity == "error"


def test_a_flattened_mesh_is_an_error(ball):
    line = ball.with_vertices(ball.vertices * [1, 0, 0])
    assert only(check_mesh(line), "have no area").severity == "error"


def test_faces_that_name_a_vertex_twice(ball):
    finding = only(check_mesh(with_faces(ball, [3, 3, 9])), "names a vertex twice")
    assert (finding.severity, finding.index, finding.repair) == ("warning", ball.n_triangles, "drop faces")


def test_faces_without_area(head):
    middle = head.vertices[head.triangles[0, :2]].mean(axis=0)
    vertices = np.concatenate([head.vertices, middle[None]])
    i, j = head.triangles[0, :2]
    sliver = with_faces(TriangleMesh(vertices, head.triangles), [i, j, len(vertices) - 1])
    finding = only(check_mesh(sliver), "has no area")
    assert (finding.index, finding.repair) == (head.n_triangles, "drop faces")


def test_thin_but_real_faces_are_no_fault(bump):
    assert check_mesh(bump.with_vertices(bump.vertices * [1, 1e-4, 1])) == []


def test_faces_that_are_there_twice(ball):
    finding = only(check_mesh(with_faces(ball, ball.triangles[7, [2, 0, 1]])), "is there twice")
    assert (finding.index, finding.repair) == (ball.n_triangles, "drop faces")


def test_non_manifold_edges_name_the_edge_and_its_faces(ball):
    i, j = ball.triangles[30, :2]
    fin = with_faces(
        TriangleMesh(np.concatenate([ball.vertices, [[3, 3, 3]]]), ball.triangles), [i, j, ball.n_vertices]
    )
    finding = next(f for f in check_mesh(fin) if "shared by 3 faces" in f.what)
    assert f"{min(i, j)}-{max(i, j)}" in finding.what
    assert str(ball.n_triangles) in finding.what
    assert finding.repair == "split edges"


def test_unreferenced_vertices(ball):
    loose = TriangleMesh(np.concatenate([ball.vertices, [[0.1, 0, 0]]]), ball.triangles)
    (finding,) = check_mesh(loose)
    assert (finding.severity, finding.index) == ("info", ball.n_vertices)


@pytest.mark.parametrize("name", ["ball", "head", "head_with_eyes", "bump"])
def test_inside_out_meshes_are_told_from_good_ones(name, request):
    mesh = request.getfixturevalue(name)
    finding = only(check_mesh(replace(mesh, triangles=mesh.triangles[:, ::-1])), "inside out")
    assert finding.repair == "turn over"


def test_a_flat_patch_has_no_inside(bump):
    flat = bump.with_vertices(bump.vertices * [1, 1, 0])
    assert check_mesh(flat) == []
    assert check_mesh(replace(flat, triangles=flat.triangles[:, ::-1])) == []


@pytest.mark.parametrize("seed", range(4))
def test_turned_faces_are_counted_and_the_first_is_named(head, seed):
    rng = np.random.default_rng(seed)
    turned = np.sort(rng.choice(head.n_triangles, 9, replace=False))
    triangles = head.triangles.copy()
    triangles[turned] = triangles[turned][:, ::-1]
    finding = only(check_mesh(replace(head, triangles=triangles)), "and 8 more")
    assert (finding.index, finding.repair) == (turned[0], "orient")


def test_a_moebius_strip_has_no_outside():
    n = 30
    angle = np.arange(n) * 2 * np.pi / n
    across = np.array([-0.3, 0.3])[None, :, None]
    spine = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)[:, None]
    direction = np.stack(
        [np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], axis=1
    )
    vertices = (spine + across * direction[:, None]).reshape(-1, 3)
    a, b = 2 * np.arange(n), 2 * np.arange(n) + 1
    c, d = np.roll(a, -1), np.roll(b, -1)
    c[-1], d[-1] = 1, 0
    triangles = np.concatenate([np.stack([a, c, b], 1), np.stack([b, c, d], 1)]).astype(np.int32)
    assert only(check_mesh(TriangleMesh(vertices, triangles)), "one-sided").severity == "warning"


def test_a_soup_of_triangles_is_told_as_one_fault(ball):
    soup = TriangleMesh(ball.vertices[ball.triangles].reshape(-1, 3), np.arange(3 * ball.n_triangles).reshape(-1, 3))
    assert only(check_mesh(soup), "share no vertices").repair == "weld"


def test_a_mesh_far_from_the_origin_loses_single_precision(ball):
    assert only(check_mesh(ball.with_vertices(ball.vertices + 1e4)), "away from the origin").severity == "warning"


def test_raising_gives_one_sentence_with_file_index_and_remedy_and_mentions_the_rest(ball, caplog):
    vertices, triangles = ball.vertices.copy(), ball.triangles.copy()
    vertices[3], triangles[8, 0] = np.nan, -4
    with pytest.raises(InputError) as caught:
        raise_for(check_mesh(TriangleMesh(vertices, triangles), "take/head.obj"))
    text = str(caught.value)
    assert text.startswith("take/head.obj: vertex 3 has the position (nan, nan, nan), which is not finite")
    assert "1 more" in text
    assert "; mend or delete it" in text
    assert "face 8 uses vertex -4" in caplog.text


def test_warnings_do_not_raise(ball):
    found = check_mesh(replace(ball, triangles=ball.triangles[:, ::-1]))
    assert found  # turned inside out, which is worth a word
    assert raise_for(found) is None
