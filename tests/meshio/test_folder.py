import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio import open_sequence, write_mesh

TRIANGLES = np.array([[0, 1, 2], [2, 1, 3]], dtype=np.int32)
FRAMES = np.random.default_rng(0).normal(size=(12, 4, 3)).astype(np.float32)


def fill(folder, names, frames=FRAMES):
    for name, frame in zip(names, frames, strict=False):
        write_mesh(folder / name, TriangleMesh(frame.astype(np.float64), TRIANGLES))
    return folder


@pytest.mark.parametrize("pattern", ["frame_{:04d}.obj", "f{}.PLY", "{}.obj", "take2_v03_{:03d}.ply", "a.{}.b.obj"])
def test_frames_follow_their_numbers(tmp_path, pattern):
    fill(tmp_path, [pattern.format(n) for n in range(8, 20)])
    sequence = open_sequence(tmp_path, fps=30)
    assert (len(sequence), sequence.n_vertices, sequence.fps) == (12, 4, 30)
    np.testing.assert_array_equal(sequence.read(0, 12), FRAMES)
    np.testing.assert_array_equal(sequence.read(5, 7), FRAMES[5:7])
    np.testing.assert_array_equal(sequence.triangles, TRIANGLES)


def test_other_files_beside_the_frames_are_ignored(tmp_path):
    fill(tmp_path, ["f1.obj", "f2.obj", "neutral.obj", "._f3.obj"])
    (tmp_path / "notes1.txt").write_text("")
    assert len(open_sequence(tmp_path)) == 2


def test_one_frame_is_a_take(tmp_path):
    assert len(open_sequence(fill(tmp_path, ["f07_v2.obj"]))) == 1


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ([], "no numbered OBJ or PLY files; name the frames like"),
        (["neutral.obj"], "no numbered OBJ or PLY files"),
        (["f1.obj", "f2.obj", "f4.obj"], r"frame 3 is missing between f1\.obj and f4\.obj; export the missing"),
        (["f1.obj", "f01.obj"], "frame 1 is there twice"),
        (["a1.obj", "a2.obj", "b1.obj"], r"2 series of files, e\.g\. a1\.obj and b1\.obj"),
        (["a1.obj", "a2.ply"], "2 series of files"),
        (["s1_f1.obj", "s1_f2.obj", "s2_f1.obj"], "differ in more than one number"),
    ],
)
def test_a_folder_that_is_no_take_is_refused(tmp_path, names, said):
    fill(tmp_path, names)
    with pytest.raises(InputError, match=said):
        open_sequence(tmp_path)


def test_a_frame_of_another_vertex_count_is_named(tmp_path):
    fill(tmp_path, ["f1.obj", "f2.obj", "f3.obj"])
    write_mesh(tmp_path / "f2.obj", TriangleMesh(np.zeros((5, 3)), TRIANGLES))
    sequence = open_sequence(tmp_path)
    with pytest.raises(InputError, match=r"f2\.obj: has 5 vertices, but f1\.obj has 4; export every frame"):
        sequence.read(0, 3)
