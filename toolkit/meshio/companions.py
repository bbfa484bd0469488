"""Files that belong to a file: a glTF's buffers and a USD's layers, which may change while it stays the same."""

from __future__ import annotations

import json
from pathlib import Path
from urllib.parse import unquote

__all__ = ["companions"]


def companions(path: Path) -> list[Path]:
    """The other files, sorted, from which a reader takes geometry beside ``path``; none where that cannot be told.

    A damaged or missing file is the reader's to complain about.
    """
    suffix = path.suffix.lower()
    found: list[Path] = []
    if suffix == ".gltf":
        found = _buffers(path)
    elif suffix in (".usd", ".usda", ".usdc"):
        found = _layers(path)
    return sorted(file for file in set(found) if file.is_file())


def _buffers(path: Path) -> list[Path]:
    try:
        uris = [buffer.get("uri", "data:") for buffer in json.loads(path.read_bytes())["buffers"]]
        return [path.parent / unquote(uri) for uri in uris if not uri.startswith("data:")]
    except (AttributeError, KeyError, TypeError, ValueError):
        return []


def _layers(path: Path) -> list[Path]:
    try:
        from pxr import Tf, UsdUtils
    except ImportError:
        return []
    try:
        layers, _, _ = UsdUtils.ComputeAllDependencies(str(path))
    except Tf.ErrorException:
        return []
    files = [Path(layer.realPath) for layer in layers if layer.realPath]
    return [file for file in files if file != path.resolve()]
