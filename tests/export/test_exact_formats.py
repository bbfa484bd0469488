"""Formats that hold exact float32 frames: what is read back is what was exported, bit for bit."""

import os
import struct
import subprocess
import sys

import numpy as np
import pytest
import trimesh

from toolkit.errors import InputError, MissingDependencyError
from toolkit.export import FORMATS, Performance, export
from toolkit.mesh import TriangleMesh
from toolkit.meshio import open_sequence, read_mesh, write_mesh
from toolkit.meshio.leftovers import temporary_name

NAMES = {"usd": "a.usdc", "abc": "a.abc", "pc2": "a.pc2", "mdd": "a.mdd", "npy": "a.npy", "obj": "objs", "ply": "plys"}


@pytest.mark.parametrize(("kind", "name"), [*NAMES.items(), ("usd", "a.usda"), ("usd", "a.usd")])
def test_frames_and_faces_come_back_bit_for_bit(tmp_path, performance, kind, name):
    reports = []
    report = export(performance, tmp_path / "out" / name, kind, lambda *r: reports.append(r))
    sequence = open_sequence(tmp_path / "out" / name, fps=29.97 if kind in ("npy", "pc2", "obj", "ply") else None)
    np.testing.assert_array_equal(sequence.read(0, 11), performance.read(0, 11))
    assert sequence.fps == pytest.approx(29.97, abs=1e-3)
    if kind not in ("npy", "pc2", "mdd"):
        np.testing.assert_array_equal(sequence.triangles, performance.triangles)
    assert (report.n_frames, report.rms_deviation) == (11, 0.0)
    assert report.n_bytes > 11 * performance.n_vertices * 12
    assert reports[-1][1:] == (11, 11)
    assert [p.name for p in (tmp_path / "out").iterdir()] == [name]


@pytest.mark.parametrize(("kind", "name"), [("usd", "a.usdc"), ("abc", "a.abc"), ("obj", "o"), ("ply", "p")])
@pytest.mark.parametrize("triangles_only", [False, True])
def test_polygons_are_kept_where_the_format_can(tmp_path, make, kind, name, triangles_only):
    performance = make(triangles_only=triangles_only)
    export(performance, tmp_path / name, kind)
    path = tmp_path / name
    mesh = read_mesh(min(path.iterdir()) if path.is_dir() else path)
    np.testing.assert_array_equal(mesh.triangles, performance.triangles)
    if triangles_only:
        assert mesh.polygons is None
    else:
        np.testing.assert_array_equal(mesh.polygons.counts, performance.polygons.counts)
        np.testing.assert_array_equal(mesh.polygons.indices, performance.polygons.indices)


def test_exports_of_the_same_input_are_the_same_bytes(tmp_path, make):
    for kind, name in (NAMES | {"gltf": "a.glb"}).items():
        written = []
        for folder in ("one", "two"):
            export(make(), tmp_path / folder / name, kind)
            path = tmp_path / folder / name
            written.append([p.read_bytes() for p in (sorted(path.iterdir()) if path.is_dir() else [path])])
        assert written[0] == written[1], kind


def test_pc2_and_mdd_headers_are_what_other_programs_expect(tmp_path, performance):
    export(performance, tmp_path / "a.pc2", "pc2")
    magic, version, points, start, rate, frames = struct.unpack("<12siiffi", (tmp_path / "a.pc2").read_bytes()[:32])
    assert (magic, version, start, rate) == (b"POINTCACHE2\0", 1, 0, 1)
    assert (points, frames) == (performance.n_vertices, 11)
    export(performance, tmp_path / "a.mdd", "mdd")
    data = (tmp_path / "a.mdd").read_bytes()
    assert struct.unpack(">ii", data[:8]) == (11, performance.n_vertices)
    assert struct.unpack(">f", data[12:16])[0] == pytest.approx(1 / 29.97)
    first = struct.unpack(">3f", data[8 + 44 : 8 + 44 + 12])
    np.testing.assert_array_equal(np.float32(first), performance.read(0, 1)[0, 0])


def test_usd_library_sees_a_mesh_with_samples(tmp_path, performance):
    from pxr import Usd, UsdGeom

    export(performance, tmp_path / "a.usdc", "usd")
    stage = Usd.Stage.Open(str(tmp_path / "a.usdc"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (0, 10, 29.97)
    assert stage.GetDefaultPrim().GetName() == "anna_s_face_2"
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/anna_s_face_2/mesh"))
    np.testing.assert_array_equal(np.array(mesh.GetPointsAttr().Get(4)), performance.read(4, 5)[0])
    np.testing.assert_array_equal(np.array(mesh.GetPointsAttr().Get()), performance.rest.astype(np.float32))
    low, high = np.array(mesh.GetExtentAttr().Get(4))
    np.testing.assert_array_equal(low, performance.read(4, 5)[0].min(axis=0))
    np.testing.assert_array_equal(high, performance.read(4, 5)[0].max(axis=0))
    assert mesh.GetSubdivisionSchemeAttr().Get() == "none"


def test_alembic_stores_clockwise_faces_and_its_sampling(tmp_path, performance):
    from alembic3d import Abc, AbcGeom

    export(performance, tmp_path / "a.abc", "abc")
    archive = Abc.IArchive(str(tmp_path / "a.abc"))
    schema = AbcGeom.IPolyMesh(archive.getTop(), "anna_s_face_2").getSchema()
    assert schema.getNumSamples() == 11
    assert schema.getTimeSampling().getSampleTime(3) == pytest.approx(3 / 29.97)
    sample = schema.getValue()
    points, face = np.array(memoryview(sample.getPositions())), np.array(memoryview(sample.getFaceIndices()))[:3]
    a, b, c = points[face].astype(float)
    assert np.dot(np.cross(b - a, c - a), a + b + c - 3 * points.mean(axis=0)) < 0  # clockwise from outside
    assert str(schema.getTopologyVariance()) == "kHomogenousTopology"


def test_other_readers_agree_on_a_ply_frame(tmp_path, make):
    performance = make(triangles_only=True)
    export(performance, tmp_path / "plys", "ply")
    files = sorted((tmp_path / "plys").iterdir())
    assert [files[0].name, files[-1].name] == ["anna_s_face_2_0001.ply", "anna_s_face_2_0011.ply"]
    theirs = trimesh.load(files[3], process=False)
    np.testing.assert_array_equal(theirs.vertices, performance.read(3, 4)[0])
    np.testing.assert_array_equal(theirs.faces, performance.triangles)


def test_an_old_export_is_replaced_and_other_files_are_not(tmp_path, performance, make):
    export(make(n_frames=20), tmp_path / "objs", "obj")
    export(performance, tmp_path / "objs", "obj")
    assert len(list((tmp_path / "objs").iterdir())) == 11
    (tmp_path / "objs" / "notes.txt").touch()
    with pytest.raises(InputError, match=r"holds 1 other files, e\.g\. notes\.txt; give a new or an empty folder"):
        export(performance, tmp_path / "objs", "obj")
    assert len(list((tmp_path / "objs").iterdir())) == 12


@pytest.mark.parametrize(("kind", "name"), [*NAMES.items(), ("gltf", "a.glb")])
def test_a_cancelled_export_leaves_what_was_there(tmp_path, performance, kind, name):
    export(performance, tmp_path / name, kind)
    before = sorted((p, p.stat().st_mtime_ns) for p in tmp_path.rglob("*"))

    def fail(start, stop):
        if start > 4:
            raise KeyboardInterrupt
        return performance.read(start, stop)

    values = {field: getattr(performance, field) for field in Performance.__dataclass_fields__}
    if kind == "gltf":  # the frames are only read after the file is there, to measure it
        return
    with pytest.raises(KeyboardInterrupt):
        export(Performance(**(values | {"read": fail})), tmp_path / name, kind)
    assert sorted((p, p.stat().st_mtime_ns) for p in tmp_path.rglob("*")) == before


def test_wrong_requests_are_refused(tmp_path, performance):
    with pytest.raises(InputError, match="'fbx' is not known as an export format; use one of gltf usd abc"):
        export(performance, tmp_path / "a.fbx", "fbx")
    with pytest.raises(InputError, match=r"does not suit the format usd; give a name that ends in \.usdc or \.usd"):
        export(performance, tmp_path / "a.abc", "usd")
    (tmp_path / "a.abc").mkdir()
    with pytest.raises(InputError, match="is a folder, but the format is one file"):
        export(performance, tmp_path / "a.abc", "abc")
    write_mesh(tmp_path / "a.obj", TriangleMesh(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32)))
    with pytest.raises(InputError, match="is a file, but the format is a folder"):
        export(performance, tmp_path / "a.obj", "obj")


def test_a_performance_that_does_not_fit_together_is_refused(performance):
    values = {field: getattr(performance, field) for field in Performance.__dataclass_fields__}
    with pytest.raises(ValueError, match=r"expected weights of shape \(11, 3\), got \(10, 3\)"):
        Performance(**(values | {"weights": performance.weights[:-1]}))
    rest = performance.rest.copy()
    rest[3, 1] = np.nan
    with pytest.raises(ValueError, match="rest has 1 values that are not finite"):
        Performance(**(values | {"rest": rest}))


@pytest.mark.parametrize(("kind", "module", "package"), [("usd", "pxr", "usd-core"), ("abc", "alembic3d", "alembic3d")])
def test_a_missing_package_is_named(tmp_path, performance, monkeypatch, kind, module, package):
    monkeypatch.setitem(sys.modules, module, None)
    extra = "usd" if kind == "usd" else "alembic"
    said = rf"needs the package {package}, which is not installed; run: pip install 'mien\[{extra}\]'"
    with pytest.raises(MissingDependencyError, match=said):
        export(performance, tmp_path / f"a{FORMATS[kind].suffixes[0]}", kind)
    assert list(tmp_path.iterdir()) == []
    path = tmp_path / f"b{FORMATS[kind].suffixes[0]}"
    path.touch()
    with pytest.raises(MissingDependencyError, match=said):
        read_mesh(path)
    with pytest.raises(MissingDependencyError, match=said):
        open_sequence(path)


def test_importing_brings_no_heavy_library():
    code = "import sys, toolkit.export; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"open3d", "trimesh", "pxr", "alembic3d", "imath"} & set(loaded)


def test_what_a_killed_export_left_is_gone_after_the_next(tmp_path, performance):
    # A number that no process has: the one that wrote it is dead.
    (tmp_path / temporary_name(tmp_path / "a.pc2").name.replace(f"-{os.getpid()}-", f"-{2**22 + 1}-")).write_bytes(b"x")
    mine = temporary_name(tmp_path / "b.pc2")
    mine.write_bytes(b"half")
    export(performance, tmp_path / "a.pc2", "pc2")
    assert {path.name for path in tmp_path.iterdir()} == {"a.pc2", mine.name}
