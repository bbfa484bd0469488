import logging

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.meshio import open_sequence, read_mesh

pytest.importorskip("pxr", reason="usd-core is not installed: pip install 'mien[usd]'")

HEAD = """#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Z"
    timeCodesPerSecond = 48
)
def Xform "face"
{
    double3 xformOp:translate = (10, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Mesh "skin"
    {
        int[] faceVertexCounts = [4, 3]
        int[] faceVertexIndices = [0, 1, 2, 3, 3, 2, 4]
        point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0), (.5,2,0)]
        %s
    }
    def Mesh "eye"
    {
        uniform token orientation = "leftHanded"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0,0,5), (1,0,5), (1,1,5)]
    }
    def Mesh "guide"
    {
        uniform token purpose = "guide"
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0,0,5), (1,0,5), (1,1,5)]
    }
}
"""
SQUARE = "[({0},0,0), (1,0,0), (1,1,0), (0,1,0), (.5,2,0)]"


def usda(tmp_path, times=()):
    samples = ", ".join(f"{t}: {SQUARE.format(t)}" for t in times)
    path = tmp_path / "face.usda"
    path.write_text(HEAD % (f"point3f[] points.timeSamples = {{ {samples} }}" if times else ""))
    return path


def test_meshes_are_joined_with_transforms_polygons_and_orientation(tmp_path, caplog):
    with caplog.at_level(logging.INFO):
        mesh = read_mesh(usda(tmp_path))
    assert "Z is up, a unit is 0.01 m" in caplog.text
    np.testing.assert_array_equal(mesh.vertices[:, 0], [10, 11, 11, 10, 10.5, 10, 11, 11])
    np.testing.assert_array_equal(mesh.polygons.counts, [4, 3, 3])
    np.testing.assert_array_equal(mesh.polygons.indices, [0, 1, 2, 3, 3, 2, 4, 7, 6, 5])


@pytest.mark.parametrize(
    ("times", "frames", "fps"),
    [
        ((0, 1, 2), (0, 1, 2), 48),
        ((2, 4, 6, 10), (2, 4, 6, 8, 10), 24),  # a writer left out one that lies between its neighbours
        ((0, 1, 2.5, 7), (0, 1, 2.5, 7), 20.571),  # on no grid: as they are
        ((3,), (3,), 48),
    ],
)
def test_frames_are_the_time_samples(tmp_path, times, frames, fps):
    sequence = open_sequence(usda(tmp_path, times))
    assert (sequence.n_vertices, sequence.fps) == (8, fps)
    np.testing.assert_array_equal(sequence.read(0, len(frames))[:, 0, 0], np.float32(frames) + 10)
    np.testing.assert_array_equal(read_mesh(usda(tmp_path, times)).vertices[0], [10 + frames[0], 0, 0])
    np.testing.assert_array_equal(sequence.triangles, read_mesh(usda(tmp_path, times)).triangles)
    assert open_sequence(usda(tmp_path, times), fps=30).fps == 30


def test_a_moving_parent_is_animation_too(tmp_path):
    path = usda(tmp_path)
    still, moving = "double3 xformOp:translate = (10, 0, 0)", "double3 xformOp:translate.timeSamples = "
    path.write_text(path.read_text().replace(still, moving + "{ 0: (1, 0, 0), 1: (2, 0, 0) }"))
    np.testing.assert_array_equal(open_sequence(path).read(0, 2)[:, 0, 0], [1, 2])


def test_what_is_no_take_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds no animation; export it with time samples"):
        open_sequence(usda(tmp_path))
    path = usda(tmp_path, (0, 1))
    path.write_text(path.read_text().replace("1: [(1,0,0), ", "1: ["))
    with pytest.raises(InputError, match="/face/skin has 4 vertices in frame 1, but 5 in frame 0"):
        open_sequence(path).read(0, 2)
    path.write_text("#usda 1.0\n")
    with pytest.raises(InputError, match="holds no mesh"):
        read_mesh(path)
    for name in ("bad.usda", "bad.usdc"):
        (tmp_path / name).write_text("nonsense")
        with pytest.raises(InputError, match="cannot be read as a USD file"):
            read_mesh(tmp_path / name)
    path = usda(tmp_path)
    path.write_text(path.read_text().replace("3, 3, 2, 4]", "3, 3, 2, 9]"))
    with pytest.raises(InputError, match=r"/face/skin uses vertex 9 .* but has 5 vertices"):
        read_mesh(path)
