"""The journal of edits, ``edits.jsonl``: append-only, one JSON object a line, undo and redo as entries like any other.

A line is on disk (fsync) before the call that wrote it returns. Each line is a *step*: ``add`` makes an edit, whose id
is the step's number; ``change``, ``switch`` and ``remove`` name an edit; ``undo`` and ``redo`` name a step. Nothing is
ever rewritten, so a killed process can lose at most the line that it was writing. A torn line is dropped with a word in
the log, wherever it stands, and the next line begins on a fresh one.
"""

from __future__ import annotations

import copy
import json
import logging
import os
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from toolkit.errors import InputError

__all__ = ["Edit", "Journal", "Replay", "Step"]

log = logging.getLogger(__name__)

_STEPS = ("add", "change", "switch", "remove")


@dataclass(frozen=True)
class Edit:
    """An edit as it stands: its ``number`` for life, ``kind``, ``data`` as given, and whether it is switched on."""

    number: int
    kind: str
    data: dict[str, Any]
    on: bool = True


@dataclass(frozen=True)
class Step:
    """One thing the user did: ``name`` (add, change, switch or remove) to the edit ``edit``; ``number`` of its line."""

    number: int
    name: str
    edit: int
    kind: str | None = None
    data: dict[str, Any] | None = None
    on: bool | None = None


@dataclass(frozen=True)
class Replay:
    """What the journal leads to: ``edits`` in order of adding, and the steps next in line for undo and redo."""

    edits: tuple[Edit, ...]
    undo: Step | None
    redo: Step | None

    @property
    def active(self) -> tuple[Edit, ...]:
        """The edits that are switched on."""
        return tuple(edit for edit in self.edits if edit.on)


class Journal:
    """An ``edits.jsonl`` to read and append to; safe among the threads of a process, and among processes (POSIX)."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._lock = threading.Lock()
        self._file, self._offset, self._last = -1, 0, 0
        self._done: list[Step] = []
        self._undone: list[Step] = []

    def replay(self) -> Replay:
        """What stands now, other processes' lines included."""
        with self._lock, _locked(self.path, writing=False) as handle:
            self._catch_up(handle)
            return Replay(
                tuple(copy.deepcopy(edit) for edit in _edits(self._done).values()),
                self._done[-1] if self._done else None,
                self._undone[-1] if self._undone else None,
            )

    def add(self, kind: str, data: Mapping[str, Any]) -> Edit:
        """A new edit, switched on; ``data`` is whatever JSON can hold."""
        number = self._append({"step": "add", "kind": kind, "data": dict(data)})
        return Edit(number, kind, copy.deepcopy(dict(data)))

    def change(self, edit: int, data: Mapping[str, Any]) -> None:
        """Give an edit new data; it keeps its number and its place in the order."""
        self._append({"step": "change", "edit": edit, "data": dict(data)})

    def switch(self, edit: int, on: bool) -> None:
        """Switch an edit off or on."""
        self._append({"step": "switch", "edit": edit, "on": bool(on)})

    def remove(self, edit: int) -> None:
        """Take an edit away; undo brings it back."""
        self._append({"step": "remove", "edit": edit})

    def undo(self) -> Step | None:
        """Take back the last step that stands; returns it, or None if there is none."""
        return self._back_and_forth("undo")

    def redo(self) -> Step | None:
        """Do again the step undone last, unless something else was done since; returns it, or None."""
        return self._back_and_forth("redo")

    def _back_and_forth(self, name: str) -> Step | None:
        with self._lock, _locked(self.path) as handle:
            self._catch_up(handle)
            stack = self._done if name == "undo" else self._undone
            if not stack:
                return None
            step = stack[-1]
            self._write(handle, {"step": name, "of": step.number})
            return step

    def _append(self, entry: dict[str, Any]) -> int:
        with self._lock, _locked(self.path) as handle:
            self._catch_up(handle)
            known = _edits(self._done)
            if entry["step"] != "add" and entry["edit"] not in known:
                have = ", ".join(map(str, known)) or "none"
                raise InputError(f"there is no edit {entry['edit']}", where=self.path, remedy=f"the edits are: {have}")
            return self._write(handle, entry)

    def _write(self, handle: int, entry: dict[str, Any]) -> int:
        number = self._last + 1
        try:
            line = json.dumps({"number": number, **entry}, allow_nan=False).encode() + b"\n"
        except (TypeError, ValueError) as error:
            raise InputError(f"the edit cannot be written as JSON ({error})", where=self.path) from error
        size = os.fstat(handle).st_size
        if size and _read(handle, size - 1, 1) != b"\n":
            line = b"\n" + line
        try:
            written = os.write(handle, line)
            if written < len(line):
                raise OSError(f"only {written} of {len(line)} bytes could be written to {self.path}")
            os.fsync(handle)
        except OSError:
            os.ftruncate(handle, size)
            raise
        self._catch_up(handle)
        return number

    def _catch_up(self, handle: int) -> None:
        """Take in the lines that were written since the last call."""
        if handle < 0:
            self._forget()
            return
        stat = os.fstat(handle)
        if stat.st_size < self._offset or stat.st_ino != self._file:
            self._forget()
        self._file = stat.st_ino
        new = _read(handle, self._offset, stat.st_size - self._offset)
        complete, _, tail = new.rpartition(b"\n")
        for line in complete.split(b"\n"):
            if line.strip() and not self._take(line):
                log.warning("%s: a torn line of %d bytes was dropped", self.path, len(line))
        self._offset += len(new) - len(tail)
        # A prefix of an object is no object, so a last line that can be read was written whole.
        if tail.strip():
            if self._take(tail):
                self._offset += len(tail)
            else:
                log.warning("%s: the torn last line (%d bytes) was dropped", self.path, len(tail))

    def _take(self, line: bytes) -> bool:
        """Take in one line; False if it is torn."""
        try:
            entry = json.loads(line)
            number, name = int(entry["number"]), entry["step"]
            if name in ("undo", "redo"):
                self._move(name, int(entry["of"]))
            else:
                step = _step(number, name, entry)
                self._done.append(step)
                self._undone.clear()
        except (ValueError, KeyError, TypeError):
            return False
        self._last = max(self._last, number)
        return True

    def _move(self, name: str, of: int) -> None:
        source, goal = (self._done, self._undone) if name == "undo" else (self._undone, self._done)
        if source and source[-1].number == of:
            goal.append(source.pop())
        else:
            log.warning("%s: %s of step %d, which is not the last one, was passed over", self.path, name, of)

    def _forget(self) -> None:
        self._file, self._offset, self._last = -1, 0, 0
        self._done, self._undone = [], []


def _step(number: int, name: str, entry: Mapping[str, Any]) -> Step:
    if name not in _STEPS:
        raise ValueError(name)
    if name == "add":
        return Step(number, name, number, str(entry["kind"]), dict(entry["data"]), True)
    edit = int(entry["edit"])
    if name == "change":
        return Step(number, name, edit, data=dict(entry["data"]))
    return Step(number, name, edit, on=bool(entry["on"]) if name == "switch" else None)


def _edits(steps: list[Step]) -> dict[int, Edit]:
    """The edits that the steps lead to, in order of adding."""
    edits: dict[int, Edit] = {}
    for step in steps:
        if step.name == "add":
            edits[step.edit] = Edit(step.edit, step.kind or "", step.data or {})
        elif step.edit not in edits:
            continue  # its line was torn, or it was removed by another process
        elif step.name == "change":
            edits[step.edit] = replace(edits[step.edit], data=step.data or {})
        elif step.name == "switch":
            edits[step.edit] = replace(edits[step.edit], on=bool(step.on))
        else:
            del edits[step.edit]
    return edits


@contextmanager
def _locked(path: Path, writing: bool = True) -> Iterator[int]:
    """The file, locked against other processes; -1 if it is not there and is only to be read."""
    is_new = not path.exists()
    if is_new and not writing:
        yield -1
        return
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND if writing else os.O_RDONLY, 0o666)
    try:
        _lock_file(handle)
        if is_new:
            _flush_folder(path.parent)
        yield handle
    finally:
        os.close(handle)  # and with it the lock


def _read(handle: int, offset: int, size: int) -> bytes:
    os.lseek(handle, offset, os.SEEK_SET)
    return os.read(handle, size)


def _lock_file(handle: int) -> None:
    try:
        import fcntl
    except ImportError:  # Windows: one process at a time
        return
    fcntl.flock(handle, fcntl.LOCK_EX)


def _flush_folder(folder: Path) -> None:
    """A new file is only safe once the folder that names it is on disk."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
