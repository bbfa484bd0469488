import numpy as np
import pytest
import trimesh

from toolkit.errors import InputError
from toolkit.mesh import Polygons, TriangleMesh
from toolkit.meshio import read_mesh, write_mesh
from toolkit.meshio.ply import read_ply_positions

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.1, 0.2, 7]])
FACES = [(0, 1, 2, 3), (0, 1, 4)]


def header(fmt, extra_vertex="", count_type="uchar", n_vertices=5, n_faces=2, before=""):
    return (
        f"ply\nformat {fmt} 1.0\ncomment made by hand\n{before}element vertex {n_vertices}\n"
        f"property float x\nproperty float y\n{extra_vertex}property float z\n"
        f"element face {n_faces}\nproperty uchar flags\nproperty list {count_type} int vertex_index\n"
        f"property list uchar float texcoord\nend_header\n"
    ).encode()


def binary_body(order, faces):
    rows = np.zeros(5, dtype=[("x", order + "f4"), ("y", order + "f4"), ("c", "u1"), ("z", order + "f4")])
    rows["x"], rows["y"], rows["z"] = VERTICES.T
    body = rows.tobytes()
    for face in faces:
        body += b"\x05" + bytes([len(face)]) + np.array(face, order + "i4").tobytes()
        body += bytes([2 * len(face)]) + np.zeros(2 * len(face), order + "f4").tobytes()
    return body


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("faces", [FACES, [(0, 1, 2), (2, 3, 4)]])
def test_binary_of_both_byte_orders_with_other_properties(tmp_path, order, faces):
    fmt = "binary_little_endian" if order == "<" else "binary_big_endian"
    path = tmp_path / "a.ply"
    path.write_bytes(header(fmt, "property uchar red\n") + binary_body(order, faces))
    mesh = read_mesh(path)
    np.testing.assert_array_equal(mesh.vertices, VERTICES.astype(np.float32))
    expected = Polygons(np.array([len(f) for f in faces]), np.concatenate(faces)).triangulate()
    np.testing.assert_array_equal(mesh.triangles, expected)
    assert (mesh.polygons is None) == all(len(f) == 3 for f in faces)
    np.testing.assert_array_equal(read_ply_positions(path), mesh.vertices)


def test_ascii_with_polygons_and_nan(tmp_path):
    path = tmp_path / "a.ply"
    rows = [f"{x} {y} {z}" for x, y, z in VERTICES]
    rows[3] = "0 nan 0"
    rows += [f"0 {len(f)} {' '.join(map(str, f))} 0" for f in FACES]
    path.write_bytes(header("ascii") + "\n".join(rows).encode())
    mesh = read_mesh(path)
    assert np.isnan(mesh.vertices[3, 1])
    np.testing.assert_array_equal(mesh.vertices[4], VERTICES[4])
    np.testing.assert_array_equal(mesh.polygons.counts, [4, 3])
    np.testing.assert_array_equal(mesh.polygons.indices, [0, 1, 2, 3, 0, 1, 4])


def test_an_element_before_the_vertices_is_skipped(tmp_path):
    path = tmp_path / "a.ply"
    before = "element camera 1\nproperty float fov\nproperty list uchar short ids\n"
    lead = np.float32(1).tobytes() + b"\x02" + np.array([7, 8], "<i2").tobytes()
    path.write_bytes(
        header("binary_little_endian", "property uchar red\n", before=before) + lead + binary_body("<", FACES)
    )
    np.testing.assert_array_equal(read_mesh(path).vertices, VERTICES.astype(np.float32))


@pytest.mark.parametrize("cut", [1, 30, 60, 100, 130])
def test_a_cut_file_is_refused(tmp_path, cut):
    whole = header("binary_little_endian", "property uchar red\n") + binary_body("<", FACES)
    (tmp_path / "a.ply").write_bytes(whole[:-cut])
    with pytest.raises(InputError, match=r"a\.ply: the file ends inside its \d (vertex|face) rows; it is cut short"):
        read_mesh(tmp_path / "a.ply")


def test_a_cut_ascii_file_is_refused(tmp_path):
    rows = "\n".join(f"{x} {y} {z}" for x, y, z in VERTICES)
    (tmp_path / "a.ply").write_bytes(header("ascii") + rows.encode() + b"\n0 4 0 1 2 3 0\n0 3 0 1")
    with pytest.raises(InputError, match="ends inside its 2 face rows"):
        read_mesh(tmp_path / "a.ply")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"solid stl\n", "not a PLY file"),
        (b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "unknown header line"),
        (b"ply\nelement vertex 0\nend_header\n", "without a format"),
        (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "no vertex property y"),
        (header("ascii", n_vertices=1, n_faces=0) + b"1 2 three", "not a number"),
        (header("ascii", n_vertices=1, n_faces=1) + b"1 2 3\n0 3 0 0 9 0", "face 0 uses vertex 9"),
    ],
)
def test_bad_files_are_refused_with_a_reason(tmp_path, data, said):
    (tmp_path / "a.ply").write_bytes(data)
    with pytest.raises(InputError, match=said):
        read_mesh(tmp_path / "a.ply")


@pytest.mark.parametrize("sides", [(3, 4), (3, 7), (4, 5), (250, 300)])
@pytest.mark.parametrize("single", [True, False])
def test_round_trip_is_exact_in_bits_and_order(tmp_path, sides, single):
    rng = np.random.default_rng(2)
    vertices = rng.normal(size=(60, 3))
    vertices[5, 1] = np.nan
    if single:
        vertices = vertices.astype(np.float32).astype(np.float64)
    counts = rng.integers(*sides, 20).astype(np.int32)
    polygons = Polygons(counts, rng.integers(0, 60, counts.sum()).astype(np.int32))
    write_mesh(tmp_path / "out.ply", TriangleMesh(vertices, polygons.triangulate(), polygons))
    back = read_mesh(tmp_path / "out.ply")
    assert back.vertices.tobytes() == vertices.tobytes()
    np.testing.assert_array_equal(back.triangles, polygons.triangulate())
    if sides != (3, 4):
        np.testing.assert_array_equal(back.polygons.counts, counts)
        np.testing.assert_array_equal(back.polygons.indices, polygons.indices)


def test_other_readers_agree(tmp_path):
    rng = np.random.default_rng(3)
    mesh = TriangleMesh(rng.normal(size=(40, 3)), rng.integers(0, 40, (30, 3)).astype(np.int32))
    write_mesh(tmp_path / "out.ply", mesh)
    theirs = trimesh.load(tmp_path / "out.ply", process=False)
    np.testing.assert_array_equal(theirs.vertices, mesh.vertices)
    np.testing.assert_array_equal(theirs.faces, mesh.triangles)
    import open3d as o3d

    legacy = o3d.io.read_triangle_mesh(str(tmp_path / "out.ply"))
    np.testing.assert_array_equal(np.asarray(legacy.vertices), mesh.vertices)
    np.testing.assert_array_equal(np.asarray(legacy.triangles), mesh.triangles)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_files_by_trimesh_are_read(tmp_path, encoding):
    box = trimesh.creation.box()
    (tmp_path / "box.ply").write_bytes(box.export(file_type="ply", encoding=encoding))
    mesh = read_mesh(tmp_path / "box.ply")
    np.testing.assert_array_equal(mesh.vertices, box.vertices)
    np.testing.assert_array_equal(mesh.triangles, box.faces)
