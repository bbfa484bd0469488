"""Hashes of what goes into a stage, so that a stage whose inputs are unchanged is not run again."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from xxhash import xxh3_128

from toolkit.errors import InputError
from toolkit.meshio.aside import written_aside
from toolkit.meshio.companions import companions

__all__ = ["HashCache", "key_of"]

_CHUNK = 8 * 2**20


def key_of(parts: dict[str, Any]) -> str:
    """Hash of a dictionary of plain values, independent of its order."""
    return hashlib.blake2b(json.dumps(parts, sort_keys=True, default=str).encode(), digest_size=16).hexdigest()


class HashCache:
    """Content hashes of files and folders, remembered by path, size and time of change."""

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._known: dict[str, list[Any]] = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            self._known = {}  # only a memory: without it files are read again

    def of(self, path: Path) -> str:
        """Hash of a file's bytes and of those that belong to it, or of a folder's file names and bytes."""
        if not path.exists():
            raise InputError("there is no such file or folder", where=path, remedy="check the path in shot.toml")
        if path.is_dir():
            return key_of({file.name: self._file(file) for file in sorted(path.iterdir()) if file.is_file()})
        others = [self._file(file) for file in companions(path)]
        return key_of({"file": self._file(path), "others": others}) if others else self._file(path)

    def save(self) -> None:
        """Write the memory down."""
        with written_aside(self._path) as temporary:
            temporary.write_text(json.dumps(self._known), encoding="utf-8")

    def _file(self, path: Path) -> str:
        stat = path.stat()
        stamp = [stat.st_size, stat.st_mtime_ns]
        name = str(path.resolve())
        known = self._known.get(name)
        if known is not None and known[:2] == stamp:
            return str(known[2])
        digest = xxh3_128()  # against change, not against malice, and quick: a take may have gigabytes
        with path.open("rb") as file:
            while chunk := file.read(_CHUNK):
                digest.update(chunk)
        self._known[name] = [*stamp, digest.hexdigest()]
        return digest.hexdigest()
