"""On a finished shot: paint a wrinkle away, undo, redo, reopen; and a kill that keeps the open edit."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from toolkit.editing import EditSession
from toolkit.shot import Shot
from toolkit.shot.journal import Journal
from viewer.state.shot_data import ShotData


def edits(shot: Path) -> tuple:
    return Journal(shot / "edits.jsonl").replay().edits


def wrinkle(shot: Path, data: ShotData) -> tuple[int, int]:
    """A frame and a vertex on the lower half of the forehead whose details are at their largest there."""
    from toolkit.stages.inputs import load_landmark_pairs

    marks = load_landmark_pairs(Shot(shot))
    rest = data.registered
    low, high = rest[[int(marks.source[marks.names.index(name)]) for name in ("nasion", "forehead_high")]]
    near = np.linalg.norm(rest - (0.75 * low + 0.25 * high), axis=1) < 0.25 * np.linalg.norm(high - low)
    ids = np.flatnonzero(near)
    details = Shot(shot).array("decompose", "details")
    size = np.linalg.norm(np.asarray(details[:, ids], dtype=np.float64), axis=2)
    frame, place = np.unravel_index(int(size.argmax()), size.shape)
    return int(frame), int(ids[place])


def test_a_wrinkle_is_painted_away(shot: Path, sit_down: Callable) -> None:
    data = ShotData(Shot(shot))
    frame, vertex = wrinkle(shot, data)
    desk = sit_down(shot)
    desk.enter("5", "detail", "remove")
    desk.key(*["shift+Right"] * (frame // 10), *["Right"] * (frame % 10))
    desk.wait(lambda state: state["frame"] == frame)
    desk.button("remove")
    x, y = desk.pixel(1, data.result[frame][vertex], data.target_framing)
    desk.picture("wrinkle_before")
    desk.drag((x - 25, y), (x + 25, y), steps=10)
    desk.wait()
    assert edits(shot) == ()
    kept = json.loads((shot / "drafts.json").read_text())["detail"]
    assert vertex in kept["region"]["vertices"]
    desk.picture("wrinkle_painted")
    desk.key("Return")
    desk.wait(lambda state: len(state["edits"]) == 1)
    desk.picture("wrinkle_gone")
    (edit,) = edits(shot)
    assert (edit.kind, edit.data["kind"], edit.data["frame"], edit.data["factor"]) == ("detail", "scale", frame, 0.0)
    assert vertex in edit.data["region"]["vertices"]
    assert not (shot / "drafts.json").exists()

    session = EditSession.open(Shot(shot))
    before, after = session.unedited_frame(frame), session.frame(frame)
    moved = np.linalg.norm(after - before, axis=1)
    assert moved[vertex] > 0.5 * moved.max() > 0
    far = np.linalg.norm(session.rest - session.rest[vertex], axis=1) > 0.3 * np.ptp(session.rest[:, 1])
    assert moved[far].max() == 0

    desk.key("z")
    desk.wait(lambda state: not state["edits"])
    assert edits(shot) == ()
    desk.key("shift+z")
    desk.wait(lambda state: len(state["edits"]) == 1)
    desk.key("6")
    desk.wait(lambda state: state["mode"] == "history" and "switch" in state["widgets"])
    desk.picture("history")
    desk.button("switch")
    desk.wait(lambda state: "switched off" in state["status"])
    assert [one.on for one in edits(shot)] == [False]
    desk.close()

    again = sit_down(shot)
    again.wait(lambda state: state["editable"] and len(state["edits"]) == 1)
    again.close()


def test_a_kill_keeps_the_open_edit_but_for_the_drag(shot: Path, sit_down: Callable) -> None:
    data = ShotData(Shot(shot))
    _, vertex = wrinkle(shot, data)
    desk = sit_down(shot)
    desk.enter("4", "pose")
    x, y = desk.pixel(1, data.result[0][vertex], data.target_framing)
    desk.drag((x, y), (x + 12, y - 10))
    desk.wait(lambda state: "last solve" in state["status"])
    kept = json.loads((shot / "drafts.json").read_text())
    desk.press(x + 12, y - 10)
    desk.move(x + 40, y + 30)
    desk.kill()
    assert json.loads((shot / "drafts.json").read_text()) == kept

    again = sit_down(shot)
    again.enter("4", "pose", "commit")
    again.key("Return")
    again.wait(lambda state: len(state["edits"]) == 1)
    (edit,) = edits(shot)
    assert edit.data["constraints"] == kept["pose"]["constraints"]
    again.close()


def test_a_kill_in_the_middle_of_a_stroke_loses_only_the_stroke(shot: Path, sit_down: Callable) -> None:
    data = ShotData(Shot(shot))
    _, vertex = wrinkle(shot, data)
    desk = sit_down(shot)
    desk.enter("5", "detail", "remove")
    x, y = desk.pixel(1, data.result[0][vertex], data.target_framing)
    desk.drag((x - 10, y), (x + 10, y))
    desk.wait()
    kept = json.loads((shot / "drafts.json").read_text())
    desk.press(x - 10, y + 40)
    for step in range(5):
        desk.move(x + 10 * step, y + 40)
    desk.kill()
    assert json.loads((shot / "drafts.json").read_text()) == kept
    assert edits(shot) == ()

    again = sit_down(shot)
    again.enter("5", "detail", "commit")
    again.key("Escape")  # gives the edit up; Open3D would end the process
    again.wait(lambda state: "given up" in state["status"])
    assert not (shot / "drafts.json").exists()
    again.key("z")
    again.wait(lambda state: "given up" not in state["status"] or (shot / "drafts.json").exists())
    again.button("remove")
    again.wait()
    again.key("Return")
    again.wait(lambda state: len(state["edits"]) == 1)
    (edit,) = edits(shot)
    assert edit.data["region"] == kept["detail"]["region"]
    assert edit.data["factor"] == 0
    again.close()
