"""An unregistered shot: pick a landmark pair, draw a closed line, register, and find everything after reopening."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np

from data.samples import SamplePaths
from toolkit.feature_lines import load_feature_lines
from toolkit.shot import Shot
from toolkit.stages import run_stages
from viewer.picking import Picker
from viewer.state.cameras import Viewpoint
from viewer.state.shot_data import ShotData


def test_landmarks_lines_and_registration(raw_shot: Path, samples: SamplePaths, sit_down: Callable) -> None:
    data = ShotData(Shot(raw_shot))
    pair = json.loads(samples.targets["asian_female"].landmarks.read_text())["pairs"][-1]
    before = json.loads((raw_shot / "landmarks.json").read_text())["pairs"]
    desk = sit_down(raw_shot)
    assert desk.state["mode"] == "landmarks"

    desk.click(*desk.pixel(0, data.source.vertices[pair["source"]], data.source_framing))
    desk.wait(lambda state: "same point on the target" in state["status"])
    desk.click(*desk.pixel(1, data.target.vertices[pair["target"]], data.target_framing))
    desk.wait(lambda state: f"landmark {len(before) + 2}" in state["status"])
    desk.picture("landmarks")
    pairs = json.loads((raw_shot / "landmarks.json").read_text())["pairs"]
    assert pairs[:-1] == before
    assert (pairs[-1]["source"], pairs[-1]["target"]) == (pair["source"], pair["target"])

    desk.key("z", "z")  # the target's half, then the source's
    desk.wait(lambda state: f"landmark {len(before) + 1}," in state["status"])
    assert json.loads((raw_shot / "landmarks.json").read_text())["pairs"] == before
    desk.key("shift+z", "shift+z")
    desk.wait(lambda state: f"landmark {len(before) + 2}" in state["status"])
    assert json.loads((raw_shot / "landmarks.json").read_text())["pairs"] == pairs

    desk.key("3")
    desk.wait(lambda state: state["mode"] == "feature_lines")
    picks = _four_round_the_mouth(data, samples)
    for count, vertex in enumerate(picks, start=1):
        desk.click(*desk.pixel(0, data.source.vertices[vertex], data.source_framing))
        desk.wait(lambda state, count=count: f"{count} picked" in state["status"])
    desk.picture("feature_line")
    desk.key("c")
    desk.wait(lambda state: "picked" not in state["status"])
    (line,) = load_feature_lines(raw_shot / "feature_lines.json")
    assert line.closed
    assert set(picks) <= set(line.vertices.tolist())

    desk.key("2")
    desk.wait(lambda state: state["mode"] == "landmarks")
    desk.button("run:register")
    desk.wait(lambda state: state["pair"] == "registration")
    desk.picture("registered")
    assert Shot(raw_shot).array("register", "distance").shape == (data.source.n_vertices,)
    desk.close()

    again = sit_down(raw_shot)
    again.key("2")
    again.wait(lambda state: f"landmark {len(pairs) + 1}" in state["status"])
    again.close()
    assert json.loads((raw_shot / "landmarks.json").read_text())["pairs"] == pairs


def _four_round_the_mouth(data: ShotData, samples: SamplePaths) -> list[int]:
    """Vertices that can be seen, on an outer line round the mouth or another closed one."""
    lines = load_feature_lines(samples.targets["asian_female"].feature_lines)
    picker = Picker(data.source.vertices, data.source.triangles)
    camera = Viewpoint().camera(data.source_framing)
    for line in sorted(lines, key=lambda line: "outer" not in line.name):
        ids = line.vertices[:: max(1, len(line.vertices) // 4)][:4]
        if len(ids) == 4 and picker.visible(np.asarray(ids), camera).all():
            return [int(v) for v in ids]
    raise AssertionError("no line of the sample can be seen from the front")


def test_all_steps_run_from_an_unregistered_shot_to_the_performance(
    raw_shot: Path, samples: SamplePaths, sit_down: Callable
) -> None:
    shutil.copyfile(samples.targets["asian_female"].feature_lines, raw_shot / "feature_lines.json")
    desk = sit_down(raw_shot)
    assert desk.state["pair"] == "references"
    desk.button("run:all")
    state = desk.wait(lambda state: state["editable"])
    desk.picture("all_run")
    assert (state["pair"], state["mode"]) == ("performance", "look")
    assert "run:all" not in state["widgets"]
    assert all(report.skipped for report in run_stages(Shot(raw_shot)))
    assert np.load(raw_shot / "result" / "frames.npy", mmap_mode="r").shape[0] == ShotData(Shot(raw_shot)).n_frames
    desk.key("space")
    desk.wait(lambda state: state["playing"] and state["frame"] > 3)
    desk.key("space")
    desk.close()
