"""Names of files and folders that are being written, which say who writes them; what a dead process left is removed."""

from __future__ import annotations

import os
import re
import secrets
import shutil
import socket
import zlib
from pathlib import Path

__all__ = ["remove_leftovers", "temporary_name"]

_NAME = re.compile(r"\..+\.(?:(?P<machine>[0-9a-f]{8})-(?P<process>\d+)-)?[0-9a-f]{8}\.part(?:\..+)?")


def temporary_name(path: Path) -> Path:
    """A hidden name beside ``path``, with its suffix, that no other process and no other call is given."""
    writer = f"{_machine()}-{os.getpid()}-{secrets.token_hex(4)}"
    return path.with_name(f".{path.stem}.{writer}.part{path.suffix}")


def remove_leftovers(folder: str | Path) -> None:
    """Delete what killed processes left half written in ``folder``, and nothing that may still be written."""
    for left in Path(folder).glob(".*.part*"):
        if (name := _NAME.fullmatch(left.name)) and not _may_live(name["machine"], name["process"]):
            shutil.rmtree(left, ignore_errors=True) if left.is_dir() else left.unlink(missing_ok=True)


def _may_live(machine: str | None, process: str | None) -> bool:
    """Whether a name's process may be at work; those of other machines cannot be asked."""
    if machine is None or process is None:  # as names were once
        return False
    if machine != _machine():
        return True
    try:
        os.kill(int(process), 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # there is one, of another user
        pass
    return True


def _machine() -> str:
    return f"{zlib.crc32(socket.gethostname().encode()):08x}"
