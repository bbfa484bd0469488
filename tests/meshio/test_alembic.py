import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.meshio import open_sequence, read_mesh

pytest.importorskip("alembic3d", reason="alembic3d is not installed: pip install 'mien[alembic]'")

FRAMES = np.random.default_rng(0).normal(size=(6, 5, 3)).astype(np.float32)
COUNTS, CORNERS = [4, 3], [3, 2, 1, 0, 4, 2, 3]  # clockwise, as Alembic has it


def write(path, frames=FRAMES, fps=25.0, counts=COUNTS, corners=CORNERS, scale=(1, 1, 1)):
    """A skin under a transform that moves, and a still eye beside it."""
    import imath
    from alembic3d import Abc, AbcCoreAbstract, AbcGeom

    archive = Abc.OArchive(str(path))
    sampling = archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1 / fps, 0.0)) if fps else 0
    parent = AbcGeom.OXform(archive.getTop(), "head", sampling)
    for t in range(len(frames)):
        sample = AbcGeom.XformSample()
        sample.setTranslation(imath.V3d(t, 0, 0))
        sample.setScale(imath.V3d(*scale))
        parent.getSchema().set(sample)
    for name, points in (("skin", frames), ("eye", FRAMES[:1] + 9)):
        schema = AbcGeom.OPolyMesh(parent if name == "skin" else archive.getTop(), name, sampling).getSchema()
        for block in points:
            values = imath.V3fArray(len(block))
            np.asarray(memoryview(values))[:] = block
            sample = AbcGeom.OPolyMeshSchemaSample(
                values,
                imath.IntArrayFromBuffer(np.array(corners, dtype=np.int32)),
                imath.IntArrayFromBuffer(np.array(counts, dtype=np.int32)),
            )
            schema.set(sample)
    del schema, parent, archive
    return path


def test_objects_are_joined_with_moving_transforms(tmp_path):
    sequence = open_sequence(write(tmp_path / "a.abc"))
    assert (sequence.n_frames, sequence.n_vertices, sequence.fps) == (6, 10, 25)
    moved = FRAMES + np.arange(6, dtype=np.float32)[:, None, None] * np.float32([1, 0, 0])
    np.testing.assert_allclose(sequence.read(0, 6)[:, :5], moved, atol=1e-6)
    np.testing.assert_array_equal(sequence.read(0, 6)[:, 5:], np.repeat(FRAMES[:1] + 9, 6, axis=0))
    mesh = read_mesh(tmp_path / "a.abc")
    np.testing.assert_array_equal(mesh.vertices[:5], FRAMES[0])
    np.testing.assert_array_equal(mesh.polygons.counts, [4, 3, 4, 3])
    np.testing.assert_array_equal(mesh.polygons.indices[:7], [0, 1, 2, 3, 3, 2, 4])
    np.testing.assert_array_equal(sequence.triangles, mesh.triangles)


def test_a_mirroring_transform_turns_the_faces(tmp_path):
    mesh = read_mesh(write(tmp_path / "a.abc", scale=(-1, 1, 1)))
    np.testing.assert_array_equal(mesh.vertices[:5], FRAMES[0] * [-1, 1, 1])
    np.testing.assert_array_equal(mesh.polygons.indices[:7], CORNERS)


def test_frame_rate(tmp_path):
    assert open_sequence(write(tmp_path / "a.abc", fps=29.97)).fps == 29.97
    assert open_sequence(write(tmp_path / "b.abc", fps=None)).fps is None
    assert open_sequence(write(tmp_path / "c.abc"), fps=60).fps == 60


def test_other_topologies_and_damage_are_refused(tmp_path):
    frames = [FRAMES[0], FRAMES[1][:4]]
    with pytest.raises(InputError, match="/head/skin has 4 vertices in frame 1, but 5 in frame 0"):
        open_sequence(write(tmp_path / "a.abc", frames, counts=[3], corners=[0, 1, 2])).read(0, 2)
    with pytest.raises(InputError, match=r"/head/skin uses vertex 5 .* but has 5 vertices"):
        read_mesh(write(tmp_path / "b.abc", corners=[5, 2, 1, 0, 4, 2, 3]))
    data = write(tmp_path / "c.abc").read_bytes()
    for name, damaged in (("d.abc", data[: len(data) // 2]), ("e.abc", b"nonsense"), ("f.abc", b"")):
        (tmp_path / name).write_bytes(damaged)
        with pytest.raises(InputError, match="cannot be read as an Alembic file"):
            read_mesh(tmp_path / name)
