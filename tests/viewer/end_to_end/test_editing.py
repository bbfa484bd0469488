"""On a finished shot: pull a mouth corner, undo, redo, scrub, play, resize, close, reopen; and a kill in a drag."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from toolkit.editing import EditSession
from toolkit.shot import Shot
from toolkit.shot.journal import Journal
from viewer.picking import Picker
from viewer.state.cameras import Viewpoint
from viewer.state.shot_data import ShotData
from viewer.timeline import Layout


def edits(shot: Path) -> tuple:
    return Journal(shot / "edits.jsonl").replay().edits


def mouth_corner(shot: Path, vertices: np.ndarray, desk: Any) -> int:
    """The vertex nearest to the corner of the mouth that can be pointed at; the corner itself may lie in the crease."""
    from toolkit.stages.inputs import load_landmark_pairs

    marks = load_landmark_pairs(Shot(shot))
    name = next(name for name in marks.names if ("mouth" in name and "corner" in name) or "cheilion" in name)
    corner = vertices[marks.source[marks.names.index(name)]]
    data = ShotData(Shot(shot))
    picker, camera = Picker(vertices, data.source.triangles), Viewpoint().camera(data.target_framing)
    left, top, *size = desk.state["panes"][1]
    for vertex in np.argsort(np.linalg.norm(vertices - corner, axis=1))[:40]:
        x, y = desk.pixel(1, vertices[vertex], data.target_framing)
        hit = picker.pick(camera, x - left + 0.5, y - top + 0.5, tuple(size))
        if hit is not None and hit.vertex == vertex:
            return int(vertex)
    raise AssertionError("the corner of the mouth cannot be seen")


def test_a_mouth_corner_is_dragged(shot: Path, sit_down: Callable) -> None:
    data = ShotData(Shot(shot))
    desk = sit_down(shot)
    desk.enter("4", "pose")
    desk.key(*["Right"] * 3)
    frame = desk.wait(lambda state: state["frame"] == 3)["frame"]
    corner = mouth_corner(shot, data.result[frame], desk)
    at = desk.pixel(1, data.result[frame][corner], data.target_framing)
    desk.drag(at, (at[0] + 18, at[1] - 22))
    desk.wait()
    desk.picture("pose_drag")
    assert edits(shot) == ()
    window = _drag_the_windows_ends(desk, data)
    desk.key("Return")
    desk.wait(lambda state: len(state["edits"]) == 1)
    desk.picture("pose_committed")
    (edit,) = edits(shot)
    asked = [c for c in edit.data["constraints"] if c.get("vertex") == corner]
    assert edit.kind == "pose"
    assert [c["frame"] for c in asked] == [frame]
    assert edit.data["parameters"]["window"] == window
    session = EditSession.open(Shot(shot))
    moved = session.frame(frame)[corner] - session.unedited_frame(frame)[corner]
    assert np.linalg.norm(moved) > 0.01 * data.target_framing.height

    desk.key("z")
    desk.wait(lambda state: not state["edits"])
    assert edits(shot) == ()
    desk.key("shift+z")
    desk.wait(lambda state: len(state["edits"]) == 1)
    assert edits(shot) == (edit,)

    _scrub_play_and_turn(desk, data)
    desk.resize(1000, 700)
    state = desk.wait(lambda state: state["size"] == [1000, 700])
    assert state["panes"][1][0] > state["panes"][0][0]
    _export(desk, shot, data)
    desk.key("question")
    desk.wait()
    assert len(np.unique(desk.picture("resized").reshape(-1, 3), axis=0)) > 1000
    desk.close()

    again = sit_down(shot, (900, 640))
    again.wait(lambda state: len(state["edits"]) == 1 and state["editable"])
    again.picture("reopened")
    again.close()
    assert edits(shot) == (edit,)


def _drag_the_windows_ends(desk: Any, data: ShotData) -> list[int]:
    """Both ends, by their handles; the window then."""
    left, top, width, height = desk.state["timeline"]
    layout = Layout(width, height, data.n_frames)
    first, last = desk.state["window"]
    y = top + sum(layout.strip) / 2
    for start, end in ((last, last - 6), (first, first + 1)):
        desk.drag((left + layout.x(start), y), (left + layout.x(end), y))
    return desk.wait(lambda state: state["window"] == [first + 1, last - 6])["window"]


def _scrub_play_and_turn(desk: Any, data: ShotData) -> None:
    desk.key("1")
    left, top, width, height = desk.state["timeline"]
    desk.drag((left + width // 4, top + height // 3), (left + width // 2, top + height // 3))
    middle = (data.n_frames - 1) / 2
    assert desk.wait(lambda state: state["mode"] == "look")["frame"] == pytest.approx(middle, abs=1)
    desk.key("space")
    desk.wait(lambda state: state["playing"] and abs(state["frame"] - middle) > 3)
    desk.key("space")
    desk.wait(lambda state: not state["playing"])
    x, y, width, height = desk.state["panes"][0]
    desk.drag((x + 20, y + height // 2), (x + 140, y + height // 2 + 30))
    assert desk.wait(lambda state: state["views"][0]["azimuth"] != 0)["views"][0]["azimuth"] < -5


def _export(desk: Any, shot: Path, data: ShotData) -> None:
    desk.key("7")
    desk.wait(lambda state: "export now" in state["widgets"])
    desk.button("format:gltf")
    desk.button("format:npy")
    desk.button("export now")
    desk.wait(lambda state: "1 format exported" in state["status"])
    (path,) = (shot / "export").iterdir()
    np.testing.assert_allclose(np.load(path)[3], EditSession.open(Shot(shot)).frame(3), atol=1e-5)


def test_a_kill_in_the_middle_of_a_drag_loses_only_the_drag(shot: Path, sit_down: Callable) -> None:
    data = ShotData(Shot(shot))
    desk = sit_down(shot)
    desk.enter("4", "pose")
    corner = mouth_corner(shot, data.result[0], desk)
    at = desk.pixel(1, data.result[0][corner], data.target_framing)
    desk.drag(at, (at[0], at[1] - 15))
    desk.wait()
    desk.key("Return")
    desk.wait(lambda state: len(state["edits"]) == 1)
    kept = edits(shot)
    at = desk.pixel(1, EditSession.open(Shot(shot)).frame(0)[corner], data.target_framing)
    desk.press(*at)
    desk.move(at[0] + 20, at[1])
    desk.kill()
    assert edits(shot) == kept

    again = sit_down(shot)
    again.wait(lambda state: state["editable"] and len(state["edits"]) == 1)
    again.close()
