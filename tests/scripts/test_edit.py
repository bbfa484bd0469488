"""scripts/6_edit.py as a user runs it."""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.shot import Shot
from toolkit.stages import run_stages

ROOT = Path(__file__).resolve().parents[2]
MIDDLE = 12 * 31 + 15


Edit = Callable[..., dict[str, Any]]


def script(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(ROOT / "scripts" / "6_edit.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture
def edit(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Edit:
    """Run the script in this process, where everything is imported already; gives its line of JSON."""
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    spec = importlib.util.spec_from_file_location("edit_script", ROOT / "scripts" / "6_edit.py")
    module = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
    spec.loader.exec_module(module)  # type: ignore[union-attr]

    def call(shot: Path, *arguments: object, code: int = 0) -> dict[str, Any]:
        capsys.readouterr()
        assert module.run(module.parser(), module.main, [str(shot), *map(str, arguments), "--json"]) == code
        said: dict[str, Any] = json.loads(capsys.readouterr().out.splitlines()[-1])
        return said

    return call


@pytest.fixture(scope="session")
def _made() -> list[Path]:
    return []


@pytest.fixture
def shot(bump: TriangleMesh, take: np.ndarray, tmp_path_factory: pytest.TempPathFactory, _made: list[Path]) -> Path:
    if not _made:
        folder = tmp_path_factory.mktemp("edited")
        write_mesh(folder / "source.ply", bump)
        write_mesh(folder / "target.ply", bump.with_vertices(bump.vertices * [12, 9, 11]))
        np.save(folder / "take.npy", take.astype(np.float32))
        text = f'[source]\nreference="{folder}/source.ply"\nframes="{folder}/take.npy"\nfps=30\n'
        (folder / "shot.toml").write_text(text + f'[target]\nreference="{folder}/target.ply"\n[bases]\ncount=4\n')
        run_stages(Shot(folder))
        _made.append(folder)
    own = tmp_path_factory.mktemp("shot") / "shot"
    shutil.copytree(_made[0], own)
    return own


def test_from_an_added_edit_to_the_result_and_back(shot: Path, edit: Edit) -> None:
    before = np.load(shot / "result" / "frames.npy")
    asked = ["--frame", 20, "--point", f"{MIDDLE}=0,0,0.8", "--window", "12:28", "--fix-farther-than", "25%"]
    said = edit(shot, "add", *asked, "--note", "higher", "--preview", 20, "--width", 80)
    assert said["edits"][0]["residuals"][0]["left"] < 0.01
    assert said["edits"][0]["moved_most"] == pytest.approx(0.8, rel=0.05)
    assert Path(said["files"][0]).read_bytes()[:4] == b"\x89PNG"
    assert np.array_equal(np.load(shot / "result" / "frames.npy"), before)
    assert edit(shot, "apply")["skipped"] is False
    after = np.load(shot / "result" / "frames.npy")
    assert np.abs(after[20, MIDDLE] - before[20, MIDDLE] - [0, 0, 0.8]).max() < 0.02
    listed = edit(shot, "list")
    assert "1 point and parts held at frame 20" in listed["edits"][0]["words"]
    assert "(higher)" in listed["edits"][0]["words"]
    assert edit(shot, "undo")["step"] == {"name": "add", "edit": 1}
    edit(shot, "apply")
    assert np.array_equal(np.load(shot / "result" / "frames.npy"), before)
    edit(shot, "redo")
    assert [report.stage for report in run_stages(Shot(shot)) if not report.skipped] == ["result"]
    assert np.array_equal(np.load(shot / "result" / "frames.npy"), after)


def test_files_changes_and_switches(shot: Path, tmp_path: Path, edit: Edit) -> None:
    pull = {"constraints": [{"kind": "point", "frame": 20, "vertex": MIDDLE, "offset": [0, 0, 0.5]}]}
    scale = {"kind": "scale", "region": {"vertices": list(range(300, 330))}, "frame": 20, "factor": 0.0}
    (tmp_path / "edits.json").write_text(json.dumps([pull, scale]))
    said = edit(shot, "add", "--file", tmp_path / "edits.json")
    assert [one["kind"] for one in said["edits"]] == ["pose", "detail"]
    edit(shot, "off", 2)
    edit(shot, "change", 1, "--frame", 10, "--distance", f"{MIDDLE},{MIDDLE + 5}=x1.1", "--mode", "weights")
    listed = edit(shot, "list")["edits"]
    assert [one["on"] for one in listed] == [True, False]
    assert "1 distance at frame 10, weights only" in listed[0]["words"]
    edit(shot, "remove", 1)
    edit(shot, "on", 2)
    picture = tmp_path / "seen.png"
    assert edit(shot, "preview", 20, "--width", 60, "--out", picture)["files"] == [str(picture)]


def test_wrinkles(shot: Path, edit: Edit) -> None:
    line = f"{MIDDLE - 5},{MIDDLE + 5}"
    said = edit(shot, "wrinkle", "--frame", 20, "--curve", line, "--within", 1.0, "--scale", 3, "--save-region", "brow")
    assert said["edits"][0]["moved_most"] > 0
    assert "brow" in json.loads((shot / "regions.json").read_text())["regions"]
    edit(shot, "wrinkle", "--frame", 20, "--region", "brow", "--remove", "--window", "15:25")
    edit(shot, "wrinkle", "--gain", "0=1,20=0.5,39=1")
    edit(shot, "wrinkle", "--frame", 20, "--region", "brow", "--paste-to", MIDDLE + 5 * 31)
    edit(shot, "wrinkle", "--frame", 20, "--curve", line, "--reshape-to", f"{MIDDLE - 36},{MIDDLE - 26}")
    words = [one["words"] for one in edit(shot, "list")["edits"]]
    assert "times 3" in words[0]
    assert "removed" in words[1]
    assert "curve of 3 keys" in words[2]
    assert "no region 'chin'" in edit(shot, "wrinkle", "--frame", 20, "--region", "chin", "--remove", code=2)["error"]


def test_regions_are_selected_kept_and_used_again(shot: Path, tmp_path: Path, edit: Edit) -> None:
    line = f"{MIDDLE - 5},{MIDDLE + 5}"

    def kept(name: str, *arguments: object) -> dict[int, float]:
        edit(shot, "region", name, *arguments)
        one = json.loads((shot / "regions.json").read_text())["regions"][name]
        return dict(zip(one["vertices"], one.get("weights", [1.0] * len(one["vertices"])), strict=True))

    along = kept("along", "--curve", line, "--within", "3%")
    soft = kept("soft", "--curve", line, "--within", "3%", "--soft", "6%")
    dab = kept("dab", "--brush", f"{MIDDLE}=10%", "--hardness", 0.3)
    assert {vertex for vertex, weight in soft.items() if weight == 1} == set(along)
    assert set(soft) > set(along)
    assert dab[MIDDLE] == 1
    assert 0 < min(dab.values()) < 0.3
    holed = kept("holed", "--region", "dab", "--erase", f"{MIDDLE}=3%")
    assert MIDDLE not in holed
    assert set(holed) < set(dab)
    larger = kept("grow", "--region", "along", "--grow", "8%")
    assert set(larger) > set(along)
    assert set(kept("shrink", "--region", "grow", "--shrink", "5%")) < set(larger)
    other = kept("other", "--brush", f"{MIDDLE + 5}=10%", "--other-side")
    assert MIDDLE + 5 not in other
    assert MIDDLE - 5 in other
    assert set(edit(shot, "region")["regions"]) == {"along", "soft", "dab", "holed", "grow", "shrink", "other"}
    both = kept("both", "--region", "along", "--vertices", "3,4", "--brush", f"{MIDDLE}=10%")
    assert set(both) == {*along, *dab, 3, 4}
    shutil.copy(shot / "regions.json", tmp_path / "mine.json")
    asked = ["--frame", 7, "--region", f"{tmp_path / 'mine.json'}:dab", "--remove", "--band", 0]
    assert edit(shot, "wrinkle", *asked)["edits"][0]["vertices"] == len(dab)
    assert "the region is empty" in edit(shot, "region", "none", code=2)["error"]


def test_all_that_can_be_done_to_a_wrinkle(
    shot: Path, tmp_path: Path, edit: Edit, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(shot, tmp_path / "another")
    region = ["--frame", 7, "--brush", f"{MIDDLE + 4}=12%"]

    def data(*arguments: object) -> tuple[dict[str, Any], dict[str, Any]]:
        """An edit as the journal holds it, and what was said of it."""
        said = edit(shot, "wrinkle", *arguments)["edits"][0]
        held = json.loads((shot / "edits.jsonl").read_text().splitlines()[-1])["data"]
        return held, said

    first, said = data(*region, "--scale", -0.5, "--threshold", 0.6)
    assert (first["factor"], first["threshold"]) == (-0.5, 0.6)
    number, (start, end) = said["number"], said["window"]
    changed, wider = data(*region, "--scale", 1.5, "--change", number)
    assert (changed["factor"], wider["number"]) == (1.5, number)
    assert wider["window"][0] < start <= 7 <= end < wider["window"][1]
    paper, said = data(*region, "--remove", "--propagation", "gradients", "--window", "5:9", "--band", 1)
    assert (paper["propagation"], said["window"]) == ("gradients", [5, 9])
    copied, _ = data(*region, "--mirror", "--turn", 20, "--times", 1.2, "--strength", 0.5, "--from", MIDDLE + 4)
    assert (copied["mirror"], copied["rotation"], copied["scale"], copied["strength"]) == (True, 20, 1.2, 0.5)
    assert "goal" not in copied
    there, _ = data(*region, "--mirror", "--paste-to", MIDDLE - 62, "--over")
    assert (there["mirror"], there["add"]) == (True, True)
    assert "goal" in there
    earlier, _ = data(*region, "--frame", 9, "--source-frame", 7, "--hold")
    assert (earlier["frame"], earlier["source_frame"], earlier["hold"]) == (9, 7, True)
    other, _ = data(*region, "--paste-to", MIDDLE - 62, "--source-shot", tmp_path / "another")
    assert other["source_shot"] == str(tmp_path / "another")
    with monkeypatch.context() as patch:
        patch.chdir(tmp_path)  # a relative one is meant from here
        beside, _ = data(*region, "--paste-to", MIDDLE - 62, "--source-shot", "another")
    assert (shot / beside["source_shot"]).resolve() == (tmp_path / "another").resolve()
    assert not Path(beside["source_shot"]).is_absolute()
    own, said = data(*region, "--static", "--remove")
    assert own["details"] == "static"
    assert said["moved_frames"] == 40
    gains, _ = data("--brush", f"{MIDDLE}=12%", "--gain", "0=1,7=0.2,12=1")
    assert gains["gains"] == [[0, 1.0], [7, 0.2], [12, 1.0]]
    assert len(gains["region"]["vertices"]) > 10
    assert len(edit(shot, "list")["edits"]) == 9
    assert "nothing is asked for" in edit(shot, "wrinkle", *region, code=2)["error"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["add", "--frame", "400", "--point", "3=0,0,1"], "no frame 400"),
        (["add", "--frame", "4", "--point", "300000=0,0,1"], "no vertex 300000"),
        (["add", "--frame", "4", "--point", "3=0,0,1", "--window", "30:60"], "window"),
        (["add"], "nothing is asked for"),
        (["remove", "7"], "no edit 7"),
    ],
)
def test_bad_input_leaves_no_edit(shot: Path, arguments: list[str], sentence: str, edit: Edit) -> None:
    assert sentence in edit(shot, *arguments, code=2)["error"]
    assert edit(shot, "list")["edits"] == []


def test_bad_usage_is_exit_code_2(tmp_path: Path, edit: Edit) -> None:
    at = ["add", "--frame", "3"]
    not_numbers = [[*at, "--point", "3=0,nan,1"], [*at, "--distance", "3,4=xinf"], [*at, "--lambda-e", "nan"]]
    for arguments in (["add", "--point", "3=0,0,1"], [*at, "--point", "3=0,0"], ["fly"], [], *not_numbers):
        with pytest.raises(SystemExit, match="2"):
            edit(tmp_path, *arguments)
    done = script(tmp_path, "list")
    assert done.returncode == 2
    assert "shot.toml" in done.stderr
    assert "Traceback" not in done.stderr
    assert "6_edit.py DIR apply" in script("--help").stdout
