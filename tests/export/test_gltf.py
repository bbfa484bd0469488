import json
import os
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh

from toolkit.export import export
from toolkit.meshio import open_sequence, read_mesh

VALIDATOR = Path(__file__).parent / "gltf_validator"
CACHE = Path(__file__).parents[2] / "data" / "cache" / "gltf-validator"


@pytest.fixture(scope="session")
def validate():
    """Return the Khronos validator as a function of a file; it is installed once, into a folder that git ignores."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if not (node and npm):
        pytest.skip("the Khronos glTF validator needs node and npm, and one of them is not installed")
    if not (CACHE / "node_modules" / "gltf-validator").is_dir():
        aside = CACHE.with_name(f"gltf-validator.{os.getpid()}.part")  # other test processes may be at it too
        shutil.copytree(VALIDATOR, aside, dirs_exist_ok=True)
        subprocess.run(
            [npm, "install", "--prefix", aside, "--no-audit", "--no-fund", "--silent"], check=True, cwd=aside
        )
        try:
            aside.rename(CACHE)
        except OSError:  # another process was first
            shutil.rmtree(aside)

    def run(path):
        command = [node, VALIDATOR / "validate.js", CACHE / "node_modules", path]
        return json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    return run


def document(path):
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + size])


@pytest.mark.parametrize(
    "options", [{}, {"still_head": True}, {"n_bases": 0}, {"n_frames": 1}, {"n_bases": 0, "still_head": True}]
)
def test_the_khronos_validator_finds_nothing(tmp_path, make, validate, options):
    export(make(**options), tmp_path / "a.glb", "gltf")
    report = validate(tmp_path / "a.glb")
    issues = report["issues"]
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
    assert report["info"]["hasMorphTargets"] == (options.get("n_bases") != 0)


def test_morphs_weights_and_head_motion_play_back(tmp_path, make):
    performance = make(residual=0)
    report = export(performance, tmp_path / "a.glb", "gltf")
    sequence = open_sequence(tmp_path / "a.glb")
    assert (sequence.n_frames, sequence.fps) == (11, pytest.approx(29.97, abs=1e-3))
    size = np.ptp(performance.rest, axis=0).max()
    np.testing.assert_allclose(sequence.read(0, 11), performance.read(0, 11), rtol=0, atol=2e-6 * size)
    np.testing.assert_array_equal(sequence.triangles, performance.triangles)
    assert report.max_deviation < 2e-6 * size


def test_deviation_is_that_of_the_file_from_the_exact_frames(tmp_path, performance):
    report = export(performance, tmp_path / "a.glb", "gltf")
    distances = np.linalg.norm(
        open_sequence(tmp_path / "a.glb").read(0, 11).astype(float) - performance.read(0, 11), axis=2
    )
    assert report.rms_deviation == pytest.approx(np.sqrt(np.mean(distances**2)), rel=1e-3)
    assert report.max_deviation == pytest.approx(distances.max(), rel=1e-3)
    assert report.rms_deviation == pytest.approx(0.01 * np.sqrt(3), rel=0.1)  # the residual that the fixture added


def test_half_way_between_frames_the_weights_are_half_way(tmp_path, make):
    performance = make(residual=0, still_head=True)
    export(performance, tmp_path / "a.glb", "gltf")
    doubled = open_sequence(tmp_path / "a.glb", fps=2 * 29.97).read(0, 21)
    expected = (performance.read(0, 10) + performance.read(1, 11)) / 2
    np.testing.assert_allclose(doubled[1::2], expected, atol=5e-5)


def test_rest_is_the_neutral_and_other_readers_agree(tmp_path, performance):
    export(performance, tmp_path / "a.glb", "gltf")
    rest = performance.rest.astype(np.float32)
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.glb").vertices, rest)
    scene = trimesh.load(tmp_path / "a.glb", process=False)
    theirs = next(iter(scene.geometry.values()))
    np.testing.assert_array_equal(theirs.vertices.astype(np.float32), rest)
    np.testing.assert_array_equal(theirs.faces, performance.triangles)
    import pygltflib

    animation = pygltflib.GLTF2().load(str(tmp_path / "a.glb")).animations[0]
    assert sorted(c.target.path for c in animation.channels) == ["rotation", "translation", "weights"]


def test_bounds_and_names_are_in_the_document(tmp_path, performance):
    export(performance, tmp_path / "a.glb", "gltf")
    gltf = document(tmp_path / "a.glb")
    mesh = gltf["meshes"][0]
    position = gltf["accessors"][mesh["primitives"][0]["attributes"]["POSITION"]]
    np.testing.assert_array_equal(np.float32(position["min"]), performance.rest.astype(np.float32).min(axis=0))
    np.testing.assert_array_equal(np.float32(position["max"]), performance.rest.astype(np.float32).max(axis=0))
    assert mesh["extras"]["targetNames"] == ["basis_00", "basis_01", "basis_02"]
    assert len(mesh["primitives"][0]["targets"]) == len(mesh["weights"]) == 3
    times = gltf["accessors"][gltf["animations"][0]["samplers"][0]["input"]]
    assert times["max"] == [pytest.approx(10 / 29.97)]


def test_stated_units_scale_the_scene_to_metres(tmp_path, make, validate):
    from dataclasses import replace

    performance = replace(make(), metres_per_unit=0.01)
    export(performance, tmp_path / "a.glb", "gltf")
    np.testing.assert_allclose(read_mesh(tmp_path / "a.glb").vertices, 0.01 * performance.rest, atol=1e-7)
    assert validate(tmp_path / "a.glb")["issues"]["numErrors"] == 0


def test_normals_follow_the_morph_targets(tmp_path, performance):
    from toolkit.mesh import vertex_normals
    from toolkit.meshio.gltf_file import GltfFile

    export(performance, tmp_path / "a.glb", "gltf")
    file = GltfFile(tmp_path / "a.glb")
    primitive = file.items("meshes")[0]["primitives"][0]
    rest = file.accessor(primitive["attributes"]["NORMAL"])
    outward = performance.rest[:-1] - [1, 2, 3]  # the last vertex is lone, in the middle
    assert (np.sum(rest[:-1] * outward, axis=1) > 8).all()
    shaped = rest + file.accessor(primitive["targets"][1]["NORMAL"])
    expected = vertex_normals(performance.morphs[1], performance.triangles)
    np.testing.assert_allclose(shaped[:-1], expected[:-1], atol=1e-6)
