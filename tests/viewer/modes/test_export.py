from __future__ import annotations

import numpy as np

from toolkit.shot import Shot
from viewer.state.events import Command, Key, PanelInput
from viewer.state.rows import Button, Check, Note


def rows_of(app, kind: type) -> list:
    return [row for row in app.rows() if isinstance(row, kind)]


def test_what_is_chosen_is_written_with_the_edits(hand, shot: Shot) -> None:
    app = hand.app
    app.choose_mode("pose")
    app.go_to_frame(20)
    at = hand.pixel_of(11 * 31 + 15)
    hand.drag(at, (at[0] + 20, at[1] - 12))
    app.handle(Key("enter"))
    hand.wait()
    edited = app.editing.session.frame(20)
    app.choose_mode("export")
    assert {row.name: row.on for row in rows_of(app, Check)}["format:gltf"]
    app.handle(PanelInput("format:gltf", False))
    assert not next(row for row in rows_of(app, Button) if row.name == "export now").enabled
    app.handle(PanelInput("export now"))
    assert "no format is chosen" in app.message
    app.handle(PanelInput("format:npy", True))
    app.handle(PanelInput("export now"))
    seen = set()
    while app.busy:
        progress = app.worker.progress
        seen |= {progress[0]} if progress is not None else set()
        app.tick(0.01)
    assert "1 format exported" in app.message
    assert len(seen) > 1  # what it is about, as it goes on
    (path,) = shot.export_folder.iterdir()
    frames = np.load(path)
    assert frames.shape[0] == app.play.n_frames
    np.testing.assert_allclose(frames[20], edited, atol=1e-5)
    (note,) = [row.text for row in rows_of(app, Note) if row.tone == "good"]
    assert note.startswith(f"{path.name}: {app.play.n_frames} frames")


def test_an_export_can_be_cancelled_and_leaves_nothing(hand, shot: Shot) -> None:
    app = hand.app
    app.choose_mode("export")
    app.handle(PanelInput("format:obj", True))
    kinds = [type(row) for row in app.rows()]
    app.handle(PanelInput("export now"))
    app.take_changes()
    while app.worker.progress is None:
        app.tick(0.01)
    app.tick(0.01)
    assert "panel" in app.take_changes()
    assert not next(row for row in rows_of(app, Button) if row.name == "export now").enabled
    assert [type(row) for row in app.rows()] == kinds  # nothing moves under the pointer
    app.handle(Command("cancel"))
    hand.wait()
    assert app.message == "the export is stopped"
    assert not list(shot.export_folder.glob("*"))
    assert next(row for row in rows_of(app, Button) if row.name == "export now").enabled
