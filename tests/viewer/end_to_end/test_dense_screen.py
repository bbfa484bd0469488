"""On a screen of twice the density everything is twice as large, and what is drawn lies where it was picked."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from benchmarks._viewer.screen import Screen, screen
from data.samples import SamplePaths
from tests.viewer.end_to_end.conftest import Desk
from toolkit.shot import Shot
from viewer.layout import PANEL
from viewer.state.marks import YELLOW
from viewer.state.shot_data import ShotData

SIZE = (1600, 1100)
DENSITY = 2


def disc(picture: np.ndarray, at: tuple[int, int]) -> tuple[np.ndarray, int]:
    """Middle and area of the yellow disc near a pixel."""
    reach = 30
    part = picture[at[1] - reach : at[1] + reach, at[0] - reach : at[0] + reach].astype(int)
    inside = (np.abs(part - 255 * np.array(YELLOW)) < 30).all(axis=2)
    rows, columns = np.nonzero(inside)
    middle = np.array([columns.mean(), rows.mean()]) if len(rows) else np.zeros(2)
    return middle - reach + at, len(rows)


@pytest.mark.skipif(shutil.which("xprop") is None, reason="xprop is missing: apt-get install -y x11-utils")
def test_a_landmark_is_picked_and_drawn_there(
    raw_shot: Path, samples: SamplePaths, xserver: Screen, tmp_path: Path
) -> None:
    data = ShotData(Shot(raw_shot))
    (raw_shot / "landmarks.json").unlink()
    pairs = json.loads(samples.targets["asian_female"].landmarks.read_text())["pairs"]
    pair = max(pairs, key=lambda pair: data.source.vertices[pair["source"], 2])  # not on an outline
    places = (data.source.vertices[pair["source"]], data.target.vertices[pair["target"]])
    with screen(tmp_path, SIZE) as shown:
        shown.set_density(96 * DENSITY)
        desk = Desk(raw_shot, shown, tmp_path, SIZE)
        try:
            (left, _, _, _), (x, _, width, _) = desk.state["panes"]
            assert left == 0
            assert SIZE[0] - (x + width) == DENSITY * 16 * PANEL
            ends = [desk.pixel(0, places[0], data.source_framing), desk.pixel(1, places[1], data.target_framing)]
            for end in ends:
                desk.click(*end)
            desk.wait(lambda state: "landmark 2" in state["status"])
            found = [disc(desk.picture("dense"), end) for end in ends]
            for _ in range(30):  # the renderer may be late
                if all(area for _, area in found):
                    break
                found = [disc(desk.picture("dense"), end) for end in ends]
        finally:
            desk.kill()
    (picked,) = json.loads((raw_shot / "landmarks.json").read_text())["pairs"]
    assert (picked["source"], picked["target"]) == (pair["source"], pair["target"])
    for end, (middle, area) in zip(ends, found, strict=True):
        assert np.abs(middle - end).max() < 2.5
        assert area == pytest.approx(np.pi * (5 * DENSITY) ** 2, rel=0.2)
