from __future__ import annotations

import threading
from pathlib import Path

from viewer.saver import Saver


def test_what_waits_is_replaced_by_what_is_newer_and_told_once() -> None:
    saver, gate, written, told = Saver(), threading.Event(), [], []
    saver.save("a", gate.wait)
    for text in ("old", "older", "newest"):
        saver.save("b", lambda text=text: written.append(text), lambda text=text: told.append(text))
    saver.save("c", lambda: written.append("another place"))
    assert saver.busy
    saver.drain()
    assert told == []
    gate.set()
    saver.flush()
    assert written == ["newest", "another place"]
    saver.drain()
    saver.drain()
    assert told == ["newest"]
    assert not saver.busy


def test_what_goes_wrong_is_said_and_the_next_is_written(tmp_path: Path) -> None:
    said: list[BaseException] = []
    saver, done = Saver(said.append), []
    saver.save("a", lambda: (tmp_path / "missing" / "file").write_text("x"), lambda: done.append(1))
    saver.flush()
    saver.drain()
    assert isinstance(said[0], FileNotFoundError)
    assert done == []
    saver.save("a", lambda: (tmp_path / "file").write_text("x"))
    saver.flush()
    assert (tmp_path / "file").read_text() == "x"
