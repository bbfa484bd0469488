"""Landmarks and feature lines on a shot of which nothing has been run."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import numpy as np
import pytest

from toolkit.checks.picks import NEEDED_LANDMARKS
from toolkit.feature_lines import FeatureLine, load_feature_lines
from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.shot import Shot
from viewer.modes import landmarks
from viewer.script import Player
from viewer.state.app import App
from viewer.state.events import Command, Key, PanelInput
from viewer.state.marks import Curve, Disc
from viewer.state.rows import Button, Note
from viewer.worker import Worker


@pytest.fixture
def raw(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> Shot:
    """Same shape, other numbering and size: the target's vertices are the source's backwards."""
    folder = tmp_path / "raw"
    folder.mkdir()
    write_mesh(folder / "source.ply", bump)
    last = bump.n_vertices - 1
    target = TriangleMesh(3 * bump.vertices[::-1] + [5, 0, 0], (last - bump.triangles).astype(np.int32))
    write_mesh(folder / "target.ply", target)
    np.save(folder / "take.npy", take.astype(np.float32))
    (folder / "shot.toml").write_text(
        '[source]\nreference="source.ply"\nframes="take.npy"\nfps=30\n[target]\nreference="target.ply"\n'
    )
    return Shot(folder)


@pytest.fixture
def user(raw: Shot, workers: list[Worker]):
    """A hand on the raw shot; ``Hand`` comes with the fixtures of this folder."""
    from tests.viewer.modes.conftest import Hand

    worker = Worker()
    workers.append(worker)
    hand = Hand(App(raw, worker))
    hand.app.pane_sizes = [Hand.SIZE, Hand.SIZE]
    hand.wait()
    return hand


def pairs(user) -> list[tuple[int, int]]:
    """What is on disk."""
    user.app.saver.flush()
    path = user.app.shot.landmarks_path
    if not path.exists():
        return []
    return [(p["source"], p["target"]) for p in json.loads(path.read_text())["pairs"]]


def lines(user) -> list[FeatureLine]:
    """What is on disk."""
    user.app.saver.flush()
    return load_feature_lines(user.app.shot.feature_lines_path)


def test_a_raw_shot_begins_with_landmarks_and_says_what_to_do(user) -> None:
    app = user.app
    assert app.mode.name == "landmarks"
    assert app.pair.name == "references"
    notes = [row.text for row in app.rows() if isinstance(row, Note)]
    assert any(text.startswith("Pick landmarks on both faces: 0 so far") for text in notes)
    assert any(f"{NEEDED_LANDMARKS} pairs at least" in text for text in notes)
    (register,) = [row for row in app.rows() if isinstance(row, Button) and row.name == "run:register"]
    assert not register.enabled
    app.handle(Command("pair", "performance"))
    assert app.pair.name == "references"
    assert "cannot be shown yet" in app.message


def test_pairs_are_picked_on_either_face_first_and_are_on_disk(user, raw: Shot) -> None:
    app = user.app
    user.click(300, pane=0)
    assert pairs(user) == []
    assert "same point on the target" in app.status_line()[0]
    user.click(120, pane=1)
    assert pairs(user) == [(300, 120)]
    user.click(500, pane=1)
    user.click(410, pane=0)
    assert pairs(user) == [(300, 120), (410, 500)]
    discs = [[mark.text for mark in app.marks(pane) if isinstance(mark, Disc)] for pane in (0, 1)]
    assert discs == [["1", "2"], ["1", "2"]]
    app.handle(PanelInput("landmark", 0))
    app.handle(PanelInput("landmark name", "nose tip"))
    user.wait()
    assert json.loads(raw.landmarks_path.read_text())["pairs"][0]["name"] == "nose tip"


def test_a_landmark_is_dragged_undone_redone_and_deleted(user, raw: Shot) -> None:
    app = user.app
    user.click(300, pane=0)
    user.click(120, pane=1)
    user.drag(user.pixel_of(300, 0), user.pixel_of(332, 0), pane=0)
    assert pairs(user) == [(332, 120)]
    app.handle(Key("z"))
    assert pairs(user) == [(300, 120)]
    app.handle(Key("z", ("shift",)))
    assert pairs(user) == [(332, 120)]
    app.handle(Key("delete"))
    assert pairs(user) == []
    app.handle(Key("z"))
    assert pairs(user) == [(332, 120)]


def test_marks_are_taken_hold_of_from_farther_on_a_dense_screen(user, raw: Shot) -> None:
    app = user.app
    user.click(300, pane=0)
    user.click(120, pane=1)
    x, y = user.pixel_of(300, 0)
    for density, wanted in ((1.0, -1), (2.0, 0)):
        app.density = density
        app.handle(PanelInput("landmark", 0))
        app.modes["landmarks"].chosen = -1
        app.modes["landmarks"].press(user.event("press", x + 13, y, 0))
        assert app.modes["landmarks"].chosen == wanted


def test_escape_drops_a_half_pair_and_another_pick_moves_it(user, raw: Shot) -> None:
    user.click(300, pane=0)
    user.click(310, pane=0)
    user.app.handle(Key("escape"))
    assert [mark for mark in user.app.marks(0) if isinstance(mark, Disc)] == []
    user.click(310, pane=0)
    user.click(420, pane=0)  # a better place for the same point
    user.click(120, pane=1)
    assert pairs(user) == [(420, 120)]


def test_a_slow_disk_holds_neither_the_window_nor_loses_a_pick(
    user, raw: Shot, monkeypatch: pytest.MonkeyPatch
) -> None:
    save, gate = landmarks.save_landmarks, threading.Event()
    monkeypatch.setattr(landmarks, "save_landmarks", lambda *told: (gate.wait(20), save(*told)))
    app = user.app
    places = [(user.pixel_of(300, 0), 0), (user.pixel_of(120, 1), 1)]
    for place, pane in places:  # returns while nothing is written yet
        user.send("press", *place, pane)
        user.send("release", *place, pane)
    app.handle(PanelInput("landmark save"))
    app.tick(0.0)
    assert not raw.landmarks_path.exists()
    assert app.busy
    assert "pairs are in" not in app.message
    threading.Timer(0.2, gate.set).start()
    app.refresh_modes()  # reads what is on disk, which is what was picked
    assert pairs(user) == [(300, 120)]
    assert app.modes["landmarks"].count == 1
    user.wait()
    assert "1 pairs are in" in app.message


def test_a_drag_beside_a_landmark_turns_the_view(user) -> None:
    before = user.app.views[0]
    user.drag((300.0, 300.0), (380.0, 300.0), pane=0)
    assert user.app.views[0].azimuth != before.azimuth
    assert user.app.views[1] == user.app.views[0]
    user.app.handle(Command("linked", False))
    user.drag((300.0, 300.0), (380.0, 300.0), pane=1)
    assert user.app.views[1].azimuth != user.app.views[0].azimuth


def test_a_closed_line_follows_edges_and_survives_undo_and_reopening(user, raw: Shot, bump: TriangleMesh) -> None:
    app = user.app
    app.handle(Key("3"))
    for vertex in (163, 176, 486, 473):
        user.click(vertex, pane=0)
    assert len([m for m in app.marks(0) if isinstance(m, Disc)]) == 4
    app.handle(Key("z"))
    assert len([m for m in app.marks(0) if isinstance(m, Disc)]) == 3
    app.handle(Key("z", ("shift",)))
    app.handle(Key("c"))
    (line,) = lines(user)
    assert line.closed
    edges = {tuple(sorted(e)) for t in bump.triangles for e in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0]))}
    assert all(tuple(sorted(pair)) in edges for pair in line.edges().tolist())
    assert {163, 176, 486, 473} <= set(line.vertices.tolist())
    app.handle(PanelInput("line name", "mouth_outer"))
    app.handle(Key("z"))
    app.handle(Key("z"))
    assert lines(user) == []
    app.handle(Key("z", ("shift",)))
    app.handle(Key("z", ("shift",)))
    assert [x.name for x in lines(user)] == ["mouth_outer"]
    app.reload()
    user.wait()
    assert any(isinstance(mark, Curve) and mark.closed for mark in app.marks(0))


def test_the_targets_side_of_a_line_and_leaving_in_the_middle(user, raw: Shot) -> None:
    app = user.app
    app.choose_mode("feature_lines")
    user.click(100, pane=1)
    assert "choose the line" in app.message
    user.click(163, pane=0)
    user.click(176, pane=0)
    app.choose_mode("look")  # what was begun is kept, open
    (line,) = lines(user)
    assert not line.closed
    app.choose_mode("feature_lines")
    app.handle(PanelInput("line", 0))
    last = 24 * 31 - 1
    user.click(last - 163, pane=1)
    user.click(last - 176, pane=1)
    app.handle(Key("enter"))
    (line,) = lines(user)
    assert line.target_vertices is not None
    assert [last - v for v in line.target_vertices.tolist()][:: len(line.target_vertices) - 1] == [163, 176]
    assert not line.guide
    app.handle(PanelInput("line guide", True))
    (line,) = lines(user)
    assert line.guide
    assert line.target_vertices is not None
    app.handle(Key("delete"))
    assert lines(user) == []


def test_stages_run_from_here_and_can_be_cancelled(user, raw: Shot, bump: TriangleMesh) -> None:
    app, last = user.app, bump.n_vertices - 1
    chosen = np.linspace(40, last - 40, 40).astype(int)
    marks = [{"name": f"m{k}", "source": int(v), "target": int(last - v)} for k, v in enumerate(chosen)]
    raw.landmarks_path.write_text(json.dumps({"pairs": marks}))
    app.reload()
    user.wait()
    assert [row.text for row in app.rows() if isinstance(row, Button) and row.name == "run:register"] == ["Register"]
    app.handle(PanelInput("run:register"))
    app.handle(Command("cancel"))
    user.wait()
    assert not app.data.has_registration
    app.handle(PanelInput("run:register"))
    app.worker.wait(300)  # a process of its own, on a machine that may be busy
    user.wait()
    assert app.data.has_registration, app.message
    assert app.pair.name == "registration"
    assert app.field(1) is not None
    assert app.field(1).scale.unit == "the target's unit"


def test_a_script_may_point_at_a_vertex(user, raw: Shot, tmp_path: Path) -> None:
    script = tmp_path / "events.jsonl"
    lines = [
        {"event": "pointer", "kind": kind, "pane": pane, "vertex": vertex}
        for pane, vertex in ((0, 300), (1, 120))
        for kind in ("press", "release")
    ]
    script.write_text("".join(json.dumps(line) + "\n" for line in lines))
    player = Player(script)
    while not player.finished:
        player.play(user.app.handle, user.app)
        user.wait()
    assert pairs(user) == [(300, 120)]
