from __future__ import annotations

import time

import numpy as np

from viewer.state.events import Command, Key


def test_edited_frames_are_built_ahead_and_are_the_same(hand) -> None:
    app = hand.app
    app.choose_mode("pose")
    app.go_to_frame(20)
    hand.wait()
    at = hand.pixel_of(11 * 31 + 15)
    hand.drag(at, (at[0] + 20, at[1] - 12))
    app.handle(Key("enter"))
    hand.wait()
    assert len(app.editing.edits) == 1
    app.handle(Command("play"))
    seen: dict[int, np.ndarray] = {}
    until = time.monotonic() + 60
    while len(seen) < app.play.n_frames and time.monotonic() < until:
        app.tick(1 / 30)  # a frame that is not built yet is waited for, but not here
        seen[app.play.frame] = app.surface_named("result").vertices.copy()
        time.sleep(0.001)
    assert len(seen) == app.play.n_frames
    for frame, shape in seen.items():
        np.testing.assert_array_equal(shape, app.editing.session.frame(frame))
    app.handle(Key("z"))
    hand.wait()
    app.tick(1 / 30)
    np.testing.assert_array_equal(app.surface_named("result").vertices, app.data.result[app.play.frame])
