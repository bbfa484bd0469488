"""Many shots in one go, and how many threads work on the frames."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.shot import Shot

ROOT = Path(__file__).resolve().parents[2]


def script(name: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "scripts" / f"{name}.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture
def listed(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> Path:
    """A list of two targets for one performance, and a third that is not there."""
    write_mesh(tmp_path / "source.ply", bump)
    np.save(tmp_path / "take.npy", take.astype(np.float32))
    for name, size in (("tall", [1, 1.3, 1]), ("wide", [1.2, 1, 1])):
        write_mesh(tmp_path / f"{name}.ply", bump.with_vertices(bump.vertices * size))
    text = '[defaults]\nsource_reference = "source.ply"\nframes = "take.npy"\nfps = 30\nsource_extras = ["tall.ply"]\n'
    for name in ("tall", "gone", "wide"):
        text += f'[[shot]]\nfolder = "shots/{name}"\ntarget = "{name}.ply"\n'
    (tmp_path / "list.toml").write_text(text)
    return tmp_path / "list.toml"


def test_a_failure_is_noted_and_the_rest_goes_on(listed: Path) -> None:
    done = script("batch", listed, "--json", "--jobs", 1)
    assert done.returncode == 1
    said = json.loads(done.stdout.splitlines()[-1])
    states = {Path(shot["shot"]).name: shot["state"] for shot in said["shots"]}
    assert states == {"tall": "done", "gone": "failed", "wide": "done"}
    assert "gone.ply" in said["shots"][1]["note"]
    shots = listed.parent / "shots"
    kept = [(shots / name / "stages" / "decompose" / "details.npy").stat() for name in ("tall", "wide")]
    assert kept[0].st_ino == kept[1].st_ino, "one performance is taken apart once"
    assert Shot(shots / "tall").config.source.extras == (listed.parent.resolve() / "tall.ply",)
    frames = [np.load(shots / name / "result" / "frames.npy") for name in ("tall", "wide")]
    assert np.abs(frames[0] - frames[1]).max() > 0.1

    (shots / "wide" / "result" / "frames.npy").unlink()
    again = script("batch", shots, "--json")
    assert again.returncode == 0, again.stderr
    states = {Path(shot["shot"]).name: shot["state"] for shot in json.loads(again.stdout.splitlines()[-1])["shots"]}
    assert states == {"tall": "up to date", "wide": "done"}
    assert np.array_equal(np.load(shots / "wide" / "result" / "frames.npy"), frames[1]), "and one thread does as many"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('[[shot]]\nfolder = "a"\ntraget = "b"\n', "traget"),
        ('[[shot]]\ntarget = "b"\n', "no folder"),
        ("[defaults]\nfps = 30\n", "[[shot]]"),
        ("shot = [1]\n", "[[shot]]"),
        ('[[shot]]\nfolder = "a"\nfps = "thirty"\n', "fps = 'thirty' is of the wrong kind"),
        ('[[shot]]\nfolder = "a"\ntarget_extras = "eyes.ply"\n', "target_extras = 'eyes.ply' is of the wrong kind"),
        ("[[shot", "not TOML"),
    ],
)
def test_a_bad_list_is_bad_input(tmp_path: Path, text: str, says: str) -> None:
    (tmp_path / "list.toml").write_text(text)
    done = script("batch", tmp_path / "list.toml")
    assert done.returncode == 2
    assert says in done.stderr


def test_jobs_is_a_number_from_one_on(tmp_path: Path) -> None:
    done = script("run_all", tmp_path, "--jobs", "0")
    assert done.returncode == 2
    assert "not a number of jobs" in done.stderr
