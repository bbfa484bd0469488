from __future__ import annotations

import json
import logging
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import pytest

from toolkit.errors import InputError
from toolkit.shot.journal import Journal


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "edits.jsonl"


def state(journal: Journal) -> list[tuple[int, dict, bool]]:
    return [(edit.number, edit.data, edit.on) for edit in journal.replay().edits]


def test_no_file_is_no_edits(path: Path) -> None:
    replay = Journal(path).replay()
    assert replay.edits == ()
    assert replay.undo is None
    assert replay.redo is None
    assert not path.exists()
    assert Journal(path).undo() is None


def test_edits_are_added_changed_switched_and_removed(path: Path) -> None:
    journal = Journal(path)
    one, two = journal.add("pose", {"a": 1}), journal.add("pose", {"a": 2})
    journal.change(one.number, {"a": 3})
    journal.switch(two.number, False)
    assert state(journal) == [(one.number, {"a": 3}, True), (two.number, {"a": 2}, False)]
    assert [edit.number for edit in journal.replay().active] == [one.number]
    journal.switch(two.number, True)
    journal.remove(one.number)
    assert state(journal) == [(two.number, {"a": 2}, True)]
    with pytest.raises(InputError, match=f"no edit {one.number}"):
        journal.change(one.number, {})


def test_undo_and_redo_pass_every_state_again_also_after_a_restart(path: Path) -> None:
    journal = Journal(path)
    states = [state(journal)]
    first = journal.add("pose", {"a": 1}).number
    for act in (
        lambda: journal.add("detail", {"b": 1}),
        lambda: journal.change(first, {"a": 2}),
        lambda: journal.switch(first, False),
        lambda: journal.remove(first),
    ):
        states.append(state(journal))
        act()
    states.append(state(journal))
    for before in reversed(states[:-1]):
        assert Journal(path).undo() is not None
        assert state(Journal(path)) == before == state(journal)
    assert journal.undo() is None
    for after in states[1:]:
        assert Journal(path).redo() is not None
        assert state(Journal(path)) == after
    assert journal.redo() is None


def test_a_new_step_ends_redo(path: Path) -> None:
    journal = Journal(path)
    journal.add("pose", {"a": 1})
    journal.undo()
    assert journal.replay().redo is not None
    journal.add("pose", {"a": 2})
    assert journal.replay().redo is None
    assert journal.redo() is None
    assert [data for _, data, _ in state(journal)] == [{"a": 2}]


def test_the_file_only_grows(path: Path) -> None:
    journal = Journal(path)
    content = b""
    for act in (lambda: journal.add("pose", {}), journal.undo, journal.redo, lambda: journal.remove(1)):
        act()
        assert path.read_bytes().startswith(content)
        content = path.read_bytes()
    assert all(isinstance(json.loads(line), dict) for line in content.splitlines())


def test_cut_anywhere_it_loses_only_the_torn_line(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    journal = Journal(path)
    for k in range(4):
        journal.add("pose", {"text": f"Größe {k}"})
    content = path.read_bytes()
    ends = [at for at, byte in enumerate(content) if byte == ord("\n")]
    for cut in range(len(content)):
        path.write_bytes(content[:cut])
        whole = sum(end <= cut for end in ends)
        with caplog.at_level(logging.WARNING):
            caplog.clear()
            assert len(Journal(path).replay().edits) == whole
            assert bool(caplog.records) == (cut not in ends and cut - 1 not in ends and cut > 0)
        # After a torn line, the next begins on a fresh one and both sides stay readable.
        Journal(path).add("pose", {"text": "after"})
        texts = [edit.data["text"] for edit in Journal(path).replay().edits]
        assert texts == [f"Größe {k}" for k in range(whole)] + ["after"]


def test_a_line_of_rubbish_in_the_middle_loses_only_itself(path: Path) -> None:
    journal = Journal(path)
    journal.add("pose", {"a": 1})
    with path.open("ab") as file:
        file.write(b'\x00\x00\xff{"number": 7\n[1, 2]\n{"number": 9, "step": "dance"}\n\n')
    journal.add("pose", {"a": 2})
    for reader in (journal, Journal(path)):
        assert [data for _, data, _ in state(reader)] == [{"a": 1}, {"a": 2}]


def test_threads_and_several_journals_append_whole_lines(path: Path) -> None:
    shared = Journal(path)

    def work(name: int) -> None:
        journal = shared if name % 2 else Journal(path)
        for k in range(10):
            journal.add("pose", {"thread": name, "k": k})

    threads = [threading.Thread(target=work, args=(name,)) for name in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    edits = Journal(path).replay().edits
    assert sorted(edit.number for edit in edits) == list(range(1, 61))
    for name in range(6):
        assert [edit.data["k"] for edit in edits if edit.data["thread"] == name] == list(range(10))


def test_what_json_cannot_hold_is_refused_and_leaves_nothing(path: Path) -> None:
    journal = Journal(path)
    journal.add("pose", {"a": 1})
    before = path.read_bytes()
    for bad in (float("nan"), {1, 2}):
        with pytest.raises(InputError, match="JSON"):
            journal.add("pose", {"a": bad})
    assert path.read_bytes() == before


def test_a_failed_write_leaves_the_journal_as_it_was(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import os

    journal = Journal(path)
    journal.add("pose", {"a": 1})
    before, whole = path.read_bytes(), os.write
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda handle, data: whole(handle, data[:5]))
        with pytest.raises(OSError, match="only 5 of"):
            journal.add("pose", {"a": 2})
    assert path.read_bytes() == before
    assert journal.add("pose", {"a": 3}).number == 2


def test_killed_many_times_it_replays_to_the_last_committed_edit(path: Path) -> None:
    """Children add edits, and say so when the call has returned; each is killed at a random moment."""
    code = textwrap.dedent(
        """
        import os, random, signal, sys, time
        from toolkit.shot.journal import Journal

        path, random = sys.argv[1], random.Random(5)
        expected = []
        for child in range(40):
            reading, writing = os.pipe()
            pid = os.fork()
            if pid == 0:
                journal, k = Journal(path), 0
                while True:
                    journal.add("pose", {"child": child, "k": k, "pad": "x" * 3000})
                    os.write(writing, b"%d\\n" % k)
                    k += 1
            os.close(writing)
            time.sleep(random.uniform(0.0, 0.03))
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            told = os.read(reading, 1 << 20).count(b"\\n")
            os.close(reading)
            expected.append(told)
        for child, told in enumerate(expected):
            print(child, told)
        """
    )
    out = subprocess.run(
        [sys.executable, "-c", code, str(path)], check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT
    )
    edits = Journal(path).replay().edits
    told = [tuple(map(int, line.split())) for line in out.stdout.splitlines()]
    assert sum(count for _, count in told) > 20
    for child, count in told:
        there = [edit.data["k"] for edit in edits if edit.data["child"] == child]
        assert there == list(range(len(there)))
        # One more than was told may be on disk: killed between writing and saying so.
        assert count <= len(there) <= count + 1


ROOT = Path(__file__).resolve().parents[2]
