"""The life of an edit that is not committed yet: undone step by step, kept through kills and other modes, reopened."""

from __future__ import annotations

import json

import pytest

from tests.viewer.modes.conftest import KEY, MIDDLE, edits
from toolkit.shot import Shot
from viewer.state.events import Key, PanelInput


def test_undo_and_redo_of_gestures_then_of_the_journal(pose, shot: Shot) -> None:
    app, mode = pose.app, pose.app.mode
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    first = mode.draft
    pose.drag((at[0] + 25, at[1]), (at[0] + 25, at[1] + 20))
    second = mode.draft
    app.handle(Key("z"))
    pose.wait()
    assert mode.draft == first
    assert pose.pixel_of(MIDDLE) == pytest.approx((at[0] + 25, at[1]), abs=1.5)
    app.handle(Key("z", ("shift",)))
    assert mode.draft == second
    app.handle(Key("escape"))
    pose.wait()
    assert mode.draft is None
    assert not app.editing.snapshot.has_draft
    app.handle(Key("z"))  # giving up is undone as well
    assert mode.draft == second
    app.handle(PanelInput("commit"))
    pose.wait()
    app.handle(Key("z"))
    pose.wait()
    assert edits(shot) == ()
    app.handle(Key("z", ("shift",)))
    pose.wait()
    assert len(edits(shot)) == 1


def test_what_a_kill_loses_is_at_most_the_drag(pose, shot: Shot, opened) -> None:
    app = pose.app
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    kept = app.mode.draft
    pose.send("press", at[0] + 25, at[1])
    pose.send("drag", at[0] + 60, at[1])
    # Here the process is killed; another one is started.
    other = opened(Shot(shot.path))
    assert other.app.modes["pose"].draft == kept
    other.app.choose_mode("pose")
    other.app.go_to_frame(KEY)
    other.wait()
    assert other.pixel_of(MIDDLE)[0] == pytest.approx(at[0] + 25, abs=1.5)
    other.app.handle(Key("enter"))
    other.wait()
    assert len(edits(shot)) == 1
    assert not (shot.path / "drafts.json").exists()


def test_a_draft_that_was_committed_before_the_kill_is_not_offered_again(pose, shot: Shot, opened) -> None:
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    drafts = (shot.path / "drafts.json").read_text()
    pose.app.handle(Key("enter"))
    pose.wait()
    (shot.path / "drafts.json").write_text(drafts)
    assert opened(Shot(shot.path)).app.modes["pose"].draft is None


def test_an_edit_is_opened_again_and_changed_in_its_place(pose, shot: Shot) -> None:
    app, mode = pose.app, pose.app.mode
    plain = app.surface(1).vertices[MIDDLE].astype(float)
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    app.handle(Key("enter"))
    pose.wait()
    mode.open(app.editing.edits[0])
    mode.enter()
    pose.wait()
    app.handle(PanelInput("dx", -0.5))
    app.handle(PanelInput("note", "the other way"))
    pose.wait()
    assert app.surface(1).vertices[MIDDLE][0] - plain[0] == pytest.approx(-0.5, abs=0.03)
    app.handle(PanelInput("commit"))
    pose.wait()
    (edit,) = edits(shot)
    assert edit.data["note"] == "the other way"
    assert edit.data["constraints"][0]["offset"][0] == -0.5
    assert app.surface(1).vertices[MIDDLE][0] - plain[0] == pytest.approx(-0.5, abs=0.03)


def test_other_modes_keep_the_open_edit_and_it_comes_back(pose) -> None:
    app, mode = pose.app, pose.app.mode
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    kept = mode.draft
    app.choose_mode("look")
    app.editing.call("elsewhere", lambda session, progress: session.drop_draft())
    pose.wait()
    app.choose_mode("pose")
    pose.wait()
    assert mode.draft == kept
    assert pose.pixel_of(MIDDLE)[0] == pytest.approx(at[0] + 25, abs=1.5)


def test_undo_of_a_draft_from_before_a_restart_gives_it_up_and_leaves_the_journal(pose, shot: Shot, opened) -> None:
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    pose.app.handle(Key("enter"))
    pose.wait()
    pose.drag((at[0] + 25, at[1]), (at[0] + 25, at[1] + 15))
    other = opened(Shot(shot.path))
    other.app.choose_mode("pose")
    other.wait()
    other.app.handle(Key("z", ("shift",)))
    assert "nothing to redo" in other.app.status_line()[0]
    other.app.handle(Key("z"))
    other.wait()
    assert other.app.mode.draft is None
    assert len(edits(shot)) == 1
    other.app.handle(Key("z"))
    other.wait()
    assert edits(shot) == ()


def test_a_draft_of_another_shot_is_not_taken_up(pose, shot: Shot, opened) -> None:
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    path = shot.path / "drafts.json"
    kept = json.loads(path.read_text())
    for name, value in (("vertex", 24 * 31), ("frame", 40)):
        wrong = json.loads(json.dumps(kept))
        wrong["pose"]["constraints"][0][name] = value
        path.write_text(json.dumps(wrong))
        other = opened(Shot(shot.path))
        assert other.app.modes["pose"].draft is None
        assert "does not fit" in other.app.status_line()[0]
    path.write_text("{")
    assert opened(Shot(shot.path)).app.modes["pose"].draft is None
