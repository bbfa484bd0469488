"""Folders written aside reach the disk while they are written, and errors on the way there are not lost."""

from __future__ import annotations

import errno
import threading
from pathlib import Path

import pytest

from toolkit.meshio import aside
from toolkit.meshio.aside import folder_aside


def test_files_are_flushed_while_the_folder_is_being_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flushed = threading.Event()
    monkeypatch.setattr(aside, "_FLUSH_SECONDS", 0.001)
    monkeypatch.setattr(aside, "_flush_to_disk", lambda file: flushed.set() if file.name == "a" else None)
    with folder_aside(tmp_path / "stage") as folder:
        (folder / "a").write_bytes(b"1")
        assert flushed.wait(30)
    assert (tmp_path / "stage" / "a").read_bytes() == b"1"


def test_an_error_of_the_disk_meanwhile_stops_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    failed = threading.Event()

    def fail_once(file: Path) -> None:
        if not failed.is_set():
            failed.set()
            raise OSError(errno.EIO, "Input/output error", str(file))

    (tmp_path / "stage").mkdir()
    (tmp_path / "stage" / "a").write_bytes(b"old")
    monkeypatch.setattr(aside, "_FLUSH_SECONDS", 0.001)
    monkeypatch.setattr(aside, "_flush_to_disk", fail_once)

    def write_anew() -> None:
        with folder_aside(tmp_path / "stage") as folder:
            (folder / "a").write_bytes(b"new")
            assert failed.wait(30)

    with pytest.raises(OSError, match="Input/output"):
        write_anew()
    assert [file.name for file in tmp_path.iterdir()] == ["stage"]
    assert (tmp_path / "stage" / "a").read_bytes() == b"old"


def test_a_file_with_a_passing_name_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = threading.Event()

    def lose(file: Path) -> None:
        if file.name == "passing":
            file.unlink()
            gone.set()
            raise FileNotFoundError(file)

    monkeypatch.setattr(aside, "_FLUSH_SECONDS", 0.001)
    monkeypatch.setattr(aside, "_flush_to_disk", lose)
    with folder_aside(tmp_path / "stage") as folder:
        (folder / "passing").write_bytes(b"1")
        assert gone.wait(30)
    assert list((tmp_path / "stage").iterdir()) == []


def test_what_was_there_is_removed_meanwhile(tmp_path: Path) -> None:
    for content in (b"old", b"new"):
        with folder_aside(tmp_path / "stage") as folder:
            (folder / "a").write_bytes(content)
    assert (tmp_path / "stage" / "a").read_bytes() == b"new"
    for thread in threading.enumerate():
        if thread.name == "remove":
            thread.join(30)
    assert [path.name for path in tmp_path.iterdir()] == ["stage"]


def test_two_that_replace_a_folder_at_once_both_come_through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aside, "_flush_to_disk", lambda file: None)
    start = threading.Barrier(2)
    went_wrong: list[BaseException] = []

    def replace_often(content: bytes) -> None:
        try:
            start.wait(30)
            for _ in range(40):
                with folder_aside(tmp_path / "stage") as folder:
                    (folder / "a").write_bytes(content)
        except BaseException as error:
            went_wrong.append(error)

    both = [threading.Thread(target=replace_often, args=(content,)) for content in (b"one", b"two")]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join(60)
    assert went_wrong == []
    assert (tmp_path / "stage" / "a").read_bytes() in (b"one", b"two")
    for thread in threading.enumerate():
        if thread.name == "remove":
            thread.join(30)
    assert [path.name for path in tmp_path.iterdir()] == ["stage"]


def test_what_was_there_comes_back_where_the_new_cannot_take_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "stage").mkdir()
    (tmp_path / "stage" / "a").write_bytes(b"old")
    rename, calls = aside.os.rename, []

    def fail_at_the_third(one: Path, other: Path) -> None:
        calls.append(other)
        if len(calls) == 3:
            raise OSError(errno.EIO, "Input/output error", str(other))
        rename(one, other)

    monkeypatch.setattr(aside.os, "rename", fail_at_the_third)
    with pytest.raises(OSError, match="Input/output"), folder_aside(tmp_path / "stage") as folder:
        (folder / "a").write_bytes(b"new")
    assert [path.name for path in tmp_path.iterdir()] == ["stage"]
    assert (tmp_path / "stage" / "a").read_bytes() == b"old"
