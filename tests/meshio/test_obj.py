import time

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.mesh import Polygons, TriangleMesh
from toolkit.meshio import read_mesh, write_mesh
from toolkit.meshio.obj import read_obj_positions


def obj(tmp_path, text):
    path = tmp_path / "face.obj"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_seams_groups_comments_and_lone_vertices_do_not_touch_the_order(tmp_path):
    path = obj(
        tmp_path,
        "# exported\nmtllib x.mtl\no head\nv 3 0 0\nv 0 1 0 # tail\n v 0 0 1\nv 9 9 9\nv 1 1 1 1.0\n"
        "vt 0 0\nvt 1 0\nvt 0 1\nvt .5 .5\nvn 0 0 1\ng skin\nusemtl a\ns 1\n"
        "f 1/1/1 2/2/1 3/3/1\nusemtl b\nf 3/4/1 2//1 5\nl 1 2\n",
    )
    mesh = read_mesh(path)
    np.testing.assert_array_equal(mesh.vertices, [[3, 0, 0], [0, 1, 0], [0, 0, 1], [9, 9, 9], [1, 1, 1]])
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [2, 1, 4]])
    assert mesh.polygons is None


def test_negative_ids_count_back_from_their_own_line(tmp_path):
    mesh = read_mesh(obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -1 -2/7 1\n"))
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [3, 2, 0]])


def test_polygons_are_kept_and_split_as_fans(tmp_path):
    points = "".join(f"v {i} {i * i} 0\n" for i in range(7))
    mesh = read_mesh(obj(tmp_path, points + "f 1 2 3 4\nf 4 3 5\nf 1 2 5 6 7\n"))
    np.testing.assert_array_equal(mesh.polygons.counts, [4, 3, 5])
    np.testing.assert_array_equal(mesh.polygons.indices, [0, 1, 2, 3, 3, 2, 4, 0, 1, 4, 5, 6])
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3], [3, 2, 4], [0, 1, 4], [0, 4, 5], [0, 5, 6]])


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_line_ends_and_continued_lines(tmp_path, newline):
    text = "v 0 0 0\nv 1 0 0\nv 0\t1 0\nf 1 \\\n 2 3"
    mesh = read_mesh(obj(tmp_path, text.replace("\n", newline)))
    np.testing.assert_array_equal(mesh.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2]])


@pytest.mark.parametrize("word", ["nan", "-nan", "NaN", "1.#QNAN", "-1.#IND00", "-nan(ind)"])
def test_nan_is_kept_for_the_validator(tmp_path, word):
    mesh = read_mesh(obj(tmp_path, f"v 0 {word} 7\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"))
    assert np.isnan(mesh.vertices[0, 1])
    assert mesh.vertices[0, 2] == 7
    assert np.isfinite(mesh.vertices).sum() == 8


def test_vertex_colours_and_mixed_columns(tmp_path):
    mesh = read_mesh(obj(tmp_path, "v 1 2 3 .5 .5 .5\nv 4 5 6\nv 7 8 9 1\nf 1 2 3\n"))
    np.testing.assert_array_equal(mesh.vertices, [[1, 2, 3], [4, 5, 6], [7, 8, 9]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("v 0 0 0\nv 1 0\n", "line 2 gives a vertex with fewer than 3"),
        ("v 0 0 0\n\nv 1 x 0\n", r"line 3 has a word that is not a number: '1 x 0'"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", r"line 4 uses vertex 3 .* there are 3 vertices"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4 uses vertex -1"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4 uses vertex 0, but OBJ counts from 1"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 c\n", "line 4 has a word"),
        ("# nothing\n", "no vertices"),
        ("", "no vertices"),
    ],
)
def test_bad_files_are_named_with_the_line(tmp_path, text, said):
    with pytest.raises(InputError, match=said) as caught:
        read_mesh(obj(tmp_path, text))
    assert "face.obj" in str(caught.value)


def test_faces_without_a_surface_are_left_out_with_a_word(tmp_path, caplog):
    mesh = read_mesh(obj(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\n"))
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2]])
    assert "left out 1 faces" in caplog.text


@pytest.mark.parametrize("single", [True, False])
def test_round_trip_is_exact_in_bits_and_order(tmp_path, single):
    rng = np.random.default_rng(1)
    vertices = rng.normal(size=(50, 3)) * 10.0 ** rng.integers(-12, 12, (50, 3))
    if single:
        vertices = vertices.astype(np.float32).astype(np.float64)
    counts = rng.integers(3, 7, 30).astype(np.int32)
    indices = rng.integers(0, 40, counts.sum()).astype(np.int32)
    polygons = Polygons(counts, indices)
    write_mesh(tmp_path / "out.obj", TriangleMesh(vertices, polygons.triangulate(), polygons))
    back = read_mesh(tmp_path / "out.obj")
    np.testing.assert_array_equal(back.vertices, vertices)
    np.testing.assert_array_equal(back.polygons.counts, counts)
    np.testing.assert_array_equal(back.polygons.indices, indices)
    np.testing.assert_array_equal(read_obj_positions(tmp_path / "out.obj"), vertices)
    assert [p.name for p in tmp_path.iterdir()] == ["out.obj"]


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = obj(tmp_path, "v 0 0 0\n")
    mesh = TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32))

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr("toolkit.meshio.aside.os.replace", fail)
    with pytest.raises(OSError, match="disk full"):
        write_mesh(path, mesh)
    assert path.read_text() == "v 0 0 0\n"
    assert [p.name for p in tmp_path.iterdir()] == ["face.obj"]


def test_a_large_file_is_read_quickly(tmp_path):
    rng = np.random.default_rng(0)
    mesh = TriangleMesh(rng.normal(size=(50_000, 3)), rng.integers(0, 50_000, (100_000, 3)).astype(np.int32))
    write_mesh(tmp_path / "large.obj", mesh)
    start = time.perf_counter()
    back = read_mesh(tmp_path / "large.obj")
    assert time.perf_counter() - start < 3  # 0.15 s on a quiet machine; a line-by-line parser needs seconds
    np.testing.assert_array_equal(back.triangles, mesh.triangles)


def test_a_byte_order_mark_does_not_hide_the_first_vertex(tmp_path):
    path = obj(tmp_path, "v 1 2 3\nv 1 0 0\nv 0 1 0\nv 4 4 4\nf 1 2 3\n".encode("utf-8-sig"))
    assert read_mesh(path).vertices[0].tolist() == [1, 2, 3]
    assert len(read_obj_positions(path)) == 4
