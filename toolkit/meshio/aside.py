"""Files and folders are written aside and renamed into place, so a killed process leaves the old or the new."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from toolkit.meshio.leftovers import temporary_name

__all__ = ["folder_aside", "written_aside"]


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
    temporary.mkdir()
    try:
        yield temporary
        for file in temporary.iterdir():
            _flush_to_disk(file)
        _replace_folder(temporary, path)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise


def _replace_folder(new: Path, path: Path) -> None:
    """Rename ``new`` to ``path``; a folder in use cannot be overwritten in one step, so the old one steps aside."""
    if not path.exists():
        os.rename(new, path)
        return
    old = temporary_name(path)
    os.rename(path, old)
    try:
        os.rename(new, path)
    except BaseException:
        os.rename(old, path)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _flush_to_disk(file: Path) -> None:
    handle = os.open(file, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
