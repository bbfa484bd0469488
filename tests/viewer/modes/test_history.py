from __future__ import annotations

import numpy as np
import pytest

from toolkit.shot import Shot
from viewer.state.events import Key, PanelInput
from viewer.state.marks import Disc
from viewer.state.rows import Items, Note

KEY = 20
MIDDLE = 11 * 31 + 15


@pytest.fixture
def history(hand):
    """The hand of a user in the history, after a pose edit at KEY and a detail edit at frame 6."""
    session = hand.app.editing.session
    point = {"kind": "point", "frame": KEY, "vertex": MIDDLE, "offset": [1.0, 0.0, 0.0]}
    held = {"kind": "fixed", "vertices": [0, 1, 2]}
    session.add("pose", {"constraints": [point, held], "parameters": {"window": [12, 28]}, "note": "the smile"})
    region = {"vertices": [MIDDLE, MIDDLE + 1, MIDDLE + 31]}
    session.add("detail", {"kind": "scale", "region": region, "frame": 6, "factor": 0.0})
    hand.app.editing.call("reading", lambda session, progress: None)
    hand.wait()
    hand.app.choose_mode("history")
    hand.wait()
    return hand


def items(app) -> Items:
    return next(row for row in app.rows() if isinstance(row, Items) and row.name == "edit")


def moved(app) -> np.ndarray:
    return np.linalg.norm(app.surface_named("result").vertices - app.surface_named("before").vertices, axis=1)


def test_the_journal_in_words(history) -> None:
    words = items(history.app).items
    assert len(words) == 2
    assert all(part in words[0] for part in ("1 ", "point", "frame 20", "frames 12 to 28", "the smile"))
    assert all(part in words[1] for part in ("2 ", "removed", "3 vertices", "frame 6"))


def test_choosing_goes_to_the_frame_and_tells_the_residuals(history) -> None:
    app = history.app
    app.handle(PanelInput("edit", 0))
    history.wait()
    assert app.play.frame == KEY
    app.rows()
    history.wait()
    notes = [row.text for row in app.rows() if isinstance(row, Note)]
    assert any(f"vertex {MIDDLE}" in text and "left" in text for text in notes)
    assert any("3 vertices held" in text for text in notes)
    (disc,) = (mark for mark in app.mode.marks(1) if isinstance(mark, Disc))
    assert disc.text == "1"
    tint = app.mode.tint(1)
    assert tint is not None
    assert set(np.flatnonzero(tint[1])) == {0, 1, 2}
    app.handle(PanelInput("edit", 1))
    assert app.play.frame == 6
    assert list(app.mode.key_frames()) == [6]


def test_switch_off_and_on_delete_undo_and_redo(history) -> None:
    app = history.app
    app.handle(PanelInput("edit", 0))
    plain = moved(app)
    assert plain[MIDDLE] > 0.5
    app.handle(Key("x"))
    history.wait()
    assert "(off)" in items(app).items[0]
    assert moved(app)[MIDDLE] < 0.1
    app.handle(PanelInput("switch"))
    history.wait()
    assert moved(app) == pytest.approx(plain)
    app.handle(PanelInput("remove"))
    history.wait()
    assert len(items(app).items) == 1
    assert app.mode.chosen.number == 2
    app.handle(PanelInput("undo"))
    history.wait()
    assert moved(app) == pytest.approx(plain)
    app.handle(PanelInput("redo"))
    history.wait()
    assert len(app.editing.edits) == 1


def test_an_edit_is_opened_in_its_own_mode(history) -> None:
    app = history.app
    app.handle(PanelInput("edit", 0))
    app.handle(Key("enter"))
    history.wait()
    assert app.mode.name == "pose"
    assert app.mode.draft.instead_of == 1
    assert app.mode.draft.handles[0].vertex == MIDDLE
    app.handle(Key("escape"))
    history.wait()
    app.choose_mode("history")
    app.handle(PanelInput("edit", 1))
    app.handle(PanelInput("open"))
    history.wait()
    assert app.mode.name == "detail"
    assert app.mode.draft.factor == 0.0
    assert len(app.editing.edits) == 2


def test_a_mark_is_clicked(history) -> None:
    app = history.app
    app.handle(PanelInput("edit", 1))
    app.go_to_frame(KEY)
    history.click(MIDDLE)
    assert app.mode.number == 1


def test_the_arrows_walk_and_a_wrong_line_is_told(history, shot: Shot) -> None:
    app = history.app
    app.handle(Key("up"))
    app.handle(Key("up"))
    assert app.mode.number == 1
    app.handle(Key("down"))
    assert app.mode.number == 2
    with shot.edits_path.open("a") as journal:
        journal.write('{"number": 9, "step": "add", "kind": "pose", "data": {"constraints": [{"kind": "what"}]}}\n')
    app.editing.call("reading", lambda session, progress: session.reload())
    history.wait()
    app.handle(Key("down"))
    assert app.mode.number == 9
    assert any("cannot be applied" in row.text for row in app.rows() if isinstance(row, Note))
    app.handle(PanelInput("open"))
    assert app.status_line()[1] == "bad"


def test_without_edits_there_is_a_word(hand) -> None:
    hand.app.choose_mode("history")
    assert any("committed" in row.text for row in hand.app.rows() if isinstance(row, Note))
    hand.app.handle(Key("x"))
    assert "no edit is chosen" in hand.app.status_line()[0]


def test_an_edit_deleted_while_it_is_open_becomes_one_of_its_own(history) -> None:
    app = history.app
    app.handle(PanelInput("edit", 0))
    app.handle(PanelInput("open"))
    history.wait()
    app.choose_mode("history")
    app.handle(PanelInput("edit", 0))
    app.handle(PanelInput("remove"))
    history.wait()
    app.choose_mode("pose")
    history.wait()
    assert app.mode.draft.instead_of is None
    app.handle(Key("enter"))
    history.wait()
    assert [edit.kind for edit in app.editing.edits] == ["detail", "pose"]
