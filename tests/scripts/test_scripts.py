"""The scripts as a user runs them: exit codes, the JSON line, one sentence for bad input."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from toolkit.feature_lines import FeatureLine, save_feature_lines
from toolkit.mesh import TriangleMesh
from toolkit.meshio import open_sequence, read_mesh, write_mesh

ROOT = Path(__file__).resolve().parents[2]
STEPS = ("1_register", "2_decompose", "3_select_bases", "4_transfer", "5_transfer_details")
ALL = (*STEPS, "new_shot", "run_all", "7_export", "render", "report", "demo", "batch")


def script(name: str, *arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "scripts" / f"{name}.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, timeout=300, check=False)


@pytest.fixture
def inputs(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> dict[str, Path]:
    folder = tmp_path / "inputs"
    folder.mkdir()
    write_mesh(folder / "source.obj", bump)
    write_mesh(folder / "target.ply", bump.with_vertices(bump.vertices * [1.2, 0.9, 1.1]))
    for t in range(0, 40, 2):
        write_mesh(folder / "take" / f"frame_{t // 2:03d}.obj", bump.with_vertices(take[t]))
    save_feature_lines(folder / "lines.json", [FeatureLine("row", False, np.arange(31))])
    return {
        "source": folder / "source.obj",
        "target": folder / "target.ply",
        "take": folder / "take",
        "lines": folder / "lines.json",
    }


def new_shot(shot: Path, inputs: dict[str, Path]) -> subprocess.CompletedProcess[str]:
    return script(
        "new_shot", shot, "--source-reference", inputs["source"], "--frames", inputs["take"],
        "--target", inputs["target"], "--feature-lines", inputs["lines"], "--fps", 25,
    )  # fmt: skip


@pytest.mark.parametrize("name", ALL)
def test_help(name: str) -> None:
    done = script(name, "--help")
    assert done.returncode == 0
    assert "usage:" in done.stdout
    assert "--json" in done.stdout


def test_from_files_to_exports(bump: TriangleMesh, inputs: dict[str, Path], tmp_path: Path) -> None:
    shot = tmp_path / "shot"
    assert f"run_all.py '{tmp_path}/my shot'" in new_shot(tmp_path / "my shot", inputs).stdout
    assert new_shot(shot, inputs).returncode == 0
    again = new_shot(shot, inputs)
    assert again.returncode == 2
    assert "exists already" in again.stderr
    for step in STEPS[1:]:
        done = script(step, shot, "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout.splitlines()[-1])["skipped"] is False
    done = script("run_all", shot, "--json")
    said = json.loads(done.stdout.splitlines()[-1])
    assert done.returncode == 0
    assert all(seconds == 0 for seconds in said["stages"].values())
    frames = np.load(shot / "result" / "frames.npy")
    assert frames.shape == (20, bump.n_vertices, 3)
    assert frames.dtype == np.float32
    assert np.array_equal(np.load(shot / "result" / "triangles.npy"), bump.triangles)
    done = script(
        "7_export", shot, "--format", "pc2", "--format", "gltf", "--format", "obj", "--metres-per-unit", "0.1", "--json"
    )
    assert done.returncode == 0, done.stderr
    paths = [Path(export["path"]) for export in json.loads(done.stdout.splitlines()[-1])["exports"]]
    assert np.array_equal(open_sequence(paths[0]).read(0, 20), frames)
    assert open_sequence(paths[1]).n_frames == 20
    rest = np.load(shot / "stages" / "register" / "target_vertices.npy")
    assert np.allclose(read_mesh(paths[1]).vertices, 0.1 * rest, atol=1e-6)
    assert np.array_equal(open_sequence(paths[2]).read(3, 4)[0], frames[3])

    look = ("render", shot, "--count", 1, "--width", 60)
    assert "older" not in script(*look).stderr
    toml = shot / "shot.toml"
    toml.write_text(toml.read_text().replace("# gain = 1.0", "gain = 0.5"))
    assert "the result is older than the shot's files, parameters or edits" in script(*look).stderr


def test_bad_input_is_one_sentence(bump: TriangleMesh, inputs: dict[str, Path], tmp_path: Path) -> None:
    shot = tmp_path / "shot"
    new_shot(shot, inputs)
    short = TriangleMesh(bump.vertices[:-31], bump.triangles[(bump.triangles < bump.n_vertices - 31).all(axis=1)])
    write_mesh(inputs["take"] / "frame_007.obj", short)
    done = script("run_all", shot, "--json")
    assert done.returncode == 2
    assert "frame_007.obj" in done.stderr
    assert len([line for line in done.stderr.splitlines() if line.startswith("error:")]) == 1
    assert "Traceback" not in done.stderr
    assert "frame_007.obj" in json.loads(done.stdout.splitlines()[-1])["error"]
    assert not (shot / "result").exists()


@pytest.mark.parametrize(
    ("name", "arguments", "sentence"),
    [
        ("run_all", ["nowhere"], "no such shot folder"),
        ("7_export", ["nowhere", "--format", "usd"], "no such shot folder"),
        ("new_shot", ["x", "--source-reference", "a.obj", "--frames", "b", "--target", "c"], "a.obj"),
    ],
)
def test_missing_files(tmp_path: Path, name: str, arguments: list[str], sentence: str) -> None:
    done = script(name, *arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr


def test_bad_usage_is_exit_code_2() -> None:
    assert script("7_export", "x", "--format", "fbx").returncode == 2
    assert script("run_all").returncode == 2
    for option in ("--count", "--width", "--height"):
        done = script("render", "x", option, "0")
        assert done.returncode == 2
        assert f"{option}: '0' is not a whole number above 0" in done.stderr
    files = ["--source-reference", "a.obj", "--frames", "b", "--target", "c"]
    assert "'0' is not a number above 0" in script("new_shot", "x", *files, "--fps", "0").stderr


def test_a_place_that_cannot_be_written_is_one_sentence(inputs: dict[str, Path], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    done = new_shot(tmp_path / "file" / "shot", inputs)
    assert done.returncode == 2
    assert "not a directory; check that the folder is there and that you may write to it." in done.stderr
    assert "Errno" not in done.stderr


def test_the_sources_stay_as_they_are(inputs: dict[str, Path], tmp_path: Path) -> None:
    files = [path for path in inputs["source"].parent.rglob("*") if path.is_file()]
    before = {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in files}
    new_shot(tmp_path / "shot", inputs)
    assert script("run_all", tmp_path / "shot").returncode == 0
    assert {path: (path.read_bytes(), path.stat().st_mtime_ns) for path in files} == before
    assert len([p for p in inputs["source"].parent.rglob("*") if p.is_file()]) == len(files)


@pytest.mark.parametrize(("how", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 130), (signal.SIGKILL, -9)])
def test_being_stopped_loses_nothing(inputs: dict[str, Path], tmp_path: Path, how: signal.Signals, code: int) -> None:
    shot = tmp_path / "shot"
    new_shot(shot, inputs)
    command = [sys.executable, str(ROOT / "scripts" / "run_all.py"), str(shot)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not list(shot.glob("stages/*")) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    os.kill(process.pid, how)
    _, said = process.communicate(timeout=60)
    if process.returncode != 0:  # it may just have finished
        assert process.returncode == code
        assert "Traceback" not in said
        assert how == signal.SIGKILL or not list(shot.rglob(".*.part*"))
    assert script("run_all", shot).returncode == 0
    assert not list(shot.rglob(".*.part*"))
    assert read_mesh(inputs["target"]).n_vertices == np.load(shot / "result" / "frames.npy").shape[1]
