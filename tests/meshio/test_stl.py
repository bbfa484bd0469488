import numpy as np
import pytest
import trimesh

from toolkit.errors import InputError
from toolkit.meshio import read_mesh
from toolkit.meshio.stl import merge_duplicates

BOX = trimesh.creation.box()


def slow_merge(points):
    seen, ids = {}, []
    for point in points:
        ids.append(seen.setdefault(tuple(point), len(seen)))
    return np.array(list(seen)), np.array(ids)


def test_merging_is_by_equal_coordinates_in_first_seen_order():
    rng = np.random.default_rng(0)
    points = rng.integers(-1, 2, (200, 3)) * rng.choice([1.0, -1.0, 1 + 1e-15], (200, 1))
    vertices, ids = merge_duplicates(points)
    expected_vertices, expected_ids = slow_merge(points)
    np.testing.assert_array_equal(vertices, expected_vertices)
    np.testing.assert_array_equal(ids, expected_ids)
    np.testing.assert_array_equal(vertices[ids], points)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii"])
def test_a_closed_box_stays_closed(tmp_path, kind):
    exported = BOX.export(file_type=kind)
    (tmp_path / "box.stl").write_bytes(exported if isinstance(exported, bytes) else exported.encode())
    mesh = read_mesh(tmp_path / "box.stl")
    assert (mesh.n_vertices, mesh.n_triangles) == (8, 12)
    np.testing.assert_allclose(mesh.vertices[mesh.triangles], BOX.vertices[BOX.faces], atol=1e-7)
    assert mesh.triangles[0].tolist() == [0, 1, 2]


def test_a_binary_file_that_begins_with_solid_is_binary(tmp_path):
    data = BOX.export(file_type="stl")
    (tmp_path / "box.stl").write_bytes(b"solid box".ljust(80, b" ") + data[80:])
    assert read_mesh(tmp_path / "box.stl").n_triangles == 12


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (BOX.export(file_type="stl")[:-1], "says 12 facets, but the file ends before them; it is cut short"),
        (b"\0" * 20, "0 facets, but the file ends"),
        (b"\0" * 84, "no vertices"),
        (BOX.export(file_type="stl_ascii").encode()[:-60], "do not make up whole facets"),
        (b"solid x\nfacet\nvertex 0 0 zero\nvertex 0 0 1\nvertex 0 1 0\nendfacet", "do not make up whole facets"),
        (b"solid x\nendsolid x\n", "no vertices"),
    ],
)
def test_damaged_files_are_refused(tmp_path, data, said):
    (tmp_path / "a.stl").write_bytes(data)
    with pytest.raises(InputError, match=said):
        read_mesh(tmp_path / "a.stl")
