"""Files and folders are written aside and renamed into place, so a killed process leaves the old or the new."""

from __future__ import annotations

import errno
import os
import shutil
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path

from toolkit.meshio.leftovers import temporary_name

__all__ = ["folder_aside", "written_aside"]

_FLUSH_SECONDS = 0.25
_THERE_ALREADY = (errno.ENOTEMPTY, errno.EEXIST)


@contextmanager
def written_aside(path: str | Path, *, room: int = 0) -> Iterator[Path]:
    """Yield a temporary path beside ``path``; on success it replaces ``path``, on any failure it is removed.

    The temporary name keeps the suffix, since some libraries choose the format by it. The parent folder is made.
    ``room`` bytes have to be free there, for libraries that do not survive a full disk; raises OSError if they aren't.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    if room > shutil.disk_usage(path.parent).free:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
    temporary = temporary_name(path)
    try:
        yield temporary
        _flush_to_disk(temporary)
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextmanager
def folder_aside(path: str | Path) -> Iterator[Path]:
    """Yield a new, empty folder beside ``path``; on success it takes the place of ``path`` and all that was in it.

    The caller makes sure beforehand that nothing of value lies in ``path``.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = temporary_name(path)
    try:
        temporary.mkdir()
        with _flushed(temporary):
            yield temporary
        _replace_folder(temporary, path)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def _replace_folder(new: Path, path: Path) -> None:
    """Rename ``new`` to ``path``; a folder in use cannot be overwritten in one step, so the old one steps aside.

    Another process may do the same at the same time: whoever comes last stays.
    """
    old: Path | None = None
    while True:
        try:
            os.rename(new, path)
            break
        except OSError as error:
            if error.errno not in _THERE_ALREADY:
                if old is not None:
                    os.rename(old, path)
                raise
        _remove_meanwhile(old)
        old = temporary_name(path)
        try:
            os.rename(path, old)
        except FileNotFoundError:
            old = None
    _remove_meanwhile(old)


def _remove_meanwhile(folder: Path | None) -> None:
    """Nobody waits for it but the end of the process: some systems take half a second to give up half a gigabyte."""
    if folder is not None:
        threading.Thread(target=shutil.rmtree, args=(folder,), kwargs={"ignore_errors": True}, name="remove").start()


@contextmanager
def _flushed(folder: Path) -> Iterator[None]:
    """See to it that what the block writes into ``folder`` is on the disk when it ends.

    A thread flushes the files while they are being written: the disk works beside the processor, not after it.
    """
    done = threading.Event()

    def flush_meanwhile() -> None:
        while not done.wait(_FLUSH_SECONDS):
            _flush_files(folder)

    with ThreadPoolExecutor(1, "flush") as pool:
        meanwhile = pool.submit(flush_meanwhile)
        try:
            yield
        finally:
            done.set()
        meanwhile.result()  # the system tells of a failed write only once
    _flush_files(folder)


def _flush_files(folder: Path) -> None:
    for file in folder.iterdir():
        with suppress(FileNotFoundError):  # it had a passing name only
            _flush_to_disk(file)


def _flush_to_disk(file: Path) -> None:
    handle = os.open(file, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
