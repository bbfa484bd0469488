"""A script played in the window: the same events again, pictures of both panes, and no stall of the main loop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from benchmarks._viewer.screen import Screen, play_script
from viewer.stalls import FREEZE


def test_a_script_is_played_and_takes_pictures(shot: Path, xserver: Screen, tmp_path: Path) -> None:
    pictures = [tmp_path / "before.png", tmp_path / "after.png"]
    corner = 1200
    lines = [
        {"event": "command", "name": "mode", "argument": "pose"},
        {"event": "command", "name": "frame", "argument": 7},
        {"wait": 0.5},
        {"screenshot": str(pictures[0])},
        {"event": "pointer", "kind": "press", "pane": 1, "vertex": corner},
        {"event": "pointer", "kind": "release", "pane": 1, "vertex": corner},
        {"event": "panel", "name": "dy", "value": 1.0},
        {"event": "key", "name": "enter"},
        {"event": "command", "name": "play"},
        {"wait": 1.0},
        {"event": "command", "name": "play"},
        {"event": "command", "name": "frame", "argument": 7},
        {"wait": 0.5},
        {"screenshot": str(pictures[1])},
    ]
    with play_script(shot, lines, xserver, tmp_path, (900, 640)) as state:
        assert state["frame"] == 7
        assert len(state["edits"]) == 1
        work = {kind: taken["cpu"] for kind, taken in state["stalls"].items() if kind != "loop"}
    assert work["tick"] > 0
    assert max(work.values()) < FREEZE
    before, after = (np.asarray(Image.open(path)).astype(int) for path in pictures)
    assert before.shape == after.shape
    half = before.shape[1] // 2
    changed = np.abs(after - before).max(axis=2) > 8
    assert not changed[:, : half - 2].any()  # the source
    assert changed[:, half + 2 :].any()
