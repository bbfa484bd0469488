from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolkit.checks import check_mesh, repair_source, repair_target
from toolkit.errors import InputError
from toolkit.mesh import Polygons, TriangleMesh
from toolkit.mesh.topology import unique_edges


def area(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def ugly(mesh, seed=0):
    """A mesh with every fault that can be repaired: turned, repeated, double, flat, finned, with loose vertices."""
    rng = np.random.default_rng(seed)
    vertices = np.concatenate([[[9, 9, 9.0]], mesh.vertices, [[2, 2, 2.0], [0, 0, 0.0]]])
    faces = mesh.triangles + 1
    faces = np.concatenate([faces, faces[[0, 3, 50]][:, [1, 2, 0]], [[5, 5, 6], [7, 8, 7]]])
    turned = rng.random(len(faces)) < 0.2
    faces[turned] = faces[turned][:, ::-1]
    i, j = mesh.triangles[40, :2] + 1
    faces = np.concatenate([faces, [[i, j, mesh.n_vertices + 1]]]).astype(np.int32)
    return TriangleMesh(vertices, faces[rng.permutation(len(faces))])


@pytest.mark.parametrize("name", ["ball", "head", "head_with_eyes", "bump"])
@pytest.mark.parametrize("repair", [repair_source, repair_target])
def test_a_good_mesh_comes_back_as_the_very_object(name, repair, request, caplog):
    mesh = request.getfixturevalue(name)
    result = repair(mesh)
    assert result.mesh is mesh
    assert result.notes == ()
    assert caplog.text == ""
    np.testing.assert_array_equal(result.vertex_map, np.arange(mesh.n_vertices))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["ball", "head"])
def test_an_ugly_target_becomes_clean_without_losing_surface(name, seed, request):
    good = request.getfixturevalue(name)
    bad = ugly(good, seed)
    result = repair_target(bad, "orc.obj")
    assert [f for f in check_mesh(result.mesh) if f.severity != "info"] == []
    fin = area(TriangleMesh(bad.vertices, bad.triangles[(bad.triangles == good.n_vertices + 1).any(axis=1)]))
    assert area(result.mesh) == pytest.approx(area(good) + fin)
    kept = result.vertex_map >= 0
    np.testing.assert_array_equal(result.mesh.vertices[result.vertex_map[kept]], bad.vertices[kept])
    np.testing.assert_array_equal(np.flatnonzero(~kept), [0, good.n_vertices + 2])


def test_the_map_keeps_landmarks_on_their_place(ball):
    bad = ugly(ball)
    result = repair_target(bad)
    landmarks = np.array([1, 20, 77, ball.n_vertices])
    np.testing.assert_array_equal(result.mesh.vertices[result.vertex_map[landmarks]], bad.vertices[landmarks])


def test_a_soup_is_merged_into_the_surface_it_came_from(ball):
    corners = ball.triangles.ravel()
    soup = TriangleMesh(ball.vertices[corners], np.arange(len(corners), dtype=np.int32).reshape(-1, 3))
    result = repair_target(soup)
    assert result.mesh.n_vertices == ball.n_vertices
    assert len(unique_edges(result.mesh.triangles)) == len(unique_edges(ball.triangles))
    assert check_mesh(result.mesh) == []
    np.testing.assert_array_equal(result.mesh.vertices[result.vertex_map], soup.vertices)


def test_touching_lips_are_not_merged(bump):
    """Coincident vertices of a mesh that hangs together stay apart: they may be lips that touch."""
    n = bump.n_vertices
    double = TriangleMesh(
        np.concatenate([bump.vertices, bump.vertices * [1, -1, 1] + [0, 2 * bump.vertices[:, 1].max(), 0]]),
        np.concatenate([bump.triangles, bump.triangles[:, ::-1] + n]).astype(np.int32),
    )
    assert repair_target(double).mesh is double


@pytest.mark.parametrize("seed", range(4))
def test_a_source_keeps_its_vertices_whatever_is_repaired(head, seed):
    bad = ugly(head, seed)
    result = repair_source(bad, "take.obj")
    assert result.mesh.vertices is bad.vertices
    np.testing.assert_array_equal(result.vertex_map, np.arange(bad.n_vertices))
    left = [f.what for f in check_mesh(result.mesh) if f.severity != "info"]
    assert all("shared by 3 faces" in what for what in left)
    assert {frozenset(f) for f in result.mesh.triangles.tolist()} == {
        frozenset(f) for f in bad.triangles.tolist() if len(set(f)) == 3
    }


@pytest.mark.parametrize("repair", [repair_source, repair_target])
def test_an_inside_out_mesh_is_turned_over_and_that_is_said(head_with_eyes, repair, caplog):
    result = repair(replace(head_with_eyes, triangles=head_with_eyes.triangles[:, ::-1]), "orc.obj")
    assert [f for f in check_mesh(result.mesh) if f.severity != "info"] == []
    assert "orc.obj: turned all faces over" in caplog.text
    turned_back = {tuple(np.roll(f, -int(np.argmin(f)))) for f in result.mesh.triangles.tolist()}
    assert turned_back == {tuple(np.roll(f, -int(np.argmin(f)))) for f in head_with_eyes.triangles.tolist()}


def quads():
    """A curved sheet of 4 x 5 quads and one pentagon's worth of corners written as a quad with a repeated corner."""
    i, j = np.meshgrid(np.arange(4), np.arange(5), indexing="ij")
    a = (i * 6 + j).ravel()
    faces = np.stack([a, a + 6, a + 7, a + 1], axis=1).astype(np.int32)
    x, y = np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), -0.2 * ((x - 2) ** 2 + (y - 2.5) ** 2).ravel()], axis=1)
    return vertices, faces


def test_polygons_of_a_source_are_turned_with_its_triangles():
    vertices, faces = quads()
    turned = faces.copy()
    turned[[3, 8]] = turned[[3, 8], ::-1]
    polygons = Polygons(np.full(len(turned), 4, dtype=np.int32), turned.ravel())
    result = repair_source(TriangleMesh(vertices, polygons.triangulate(), polygons))
    np.testing.assert_array_equal(result.mesh.polygons.triangulate(), result.mesh.triangles)
    assert check_mesh(result.mesh) == []
    for before, after in zip(turned, result.mesh.polygons.indices.reshape(-1, 4), strict=True):
        assert after[0] == before[0]
        assert set(after) == set(before)


def test_polygons_lose_repeated_corners_and_stay_in_step():
    vertices, faces = quads()
    faces[2, 3] = faces[2, 2]  # a quad written with a repeated corner is a triangle
    faces[5] = [9, 9, 10, 10]  # and this one is nothing
    polygons = Polygons(np.full(len(faces), 4, dtype=np.int32), faces.ravel())
    result = repair_source(TriangleMesh(vertices, polygons.triangulate(), polygons))
    assert result.mesh.polygons.counts.tolist() == [4, 4, 3] + [4] * (len(faces) - 4)
    np.testing.assert_array_equal(result.mesh.polygons.triangulate(), result.mesh.triangles)
    assert [f for f in check_mesh(result.mesh) if f.severity != "info"] == []


@pytest.mark.parametrize("repair", [repair_source, repair_target])
def test_nothing_is_repaired_before_the_mesh_is_usable(ball, repair):
    vertices = ball.vertices.copy()
    vertices[4] = np.nan
    with pytest.raises(InputError, match=r"orc\.obj: vertex 4 .* not finite"):
        repair(ball.with_vertices(vertices), "orc.obj")
