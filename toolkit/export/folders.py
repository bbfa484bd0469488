"""A folder with one OBJ or PLY file a frame, numbered from 1, with the original polygons."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.export.performance import Performance
from toolkit.meshio.aside import folder_aside
from toolkit.meshio.obj import face_text, vertex_text
from toolkit.meshio.ply import face_bytes, header_bytes
from toolkit.progress import Progress

__all__ = ["write_obj_frames", "write_ply_frames"]


def write_obj_frames(performance: Performance, path: Path, progress: Progress) -> None:
    """Write OBJ files; nine digits bring back the float32 positions bit for bit."""
    faces = face_text(performance.mesh)
    _write_frames(performance, path, ".obj", lambda frame: vertex_text(frame) + faces, progress)


def write_ply_frames(performance: Performance, path: Path, progress: Progress) -> None:
    """Write little-endian binary PLY files."""
    header, faces = header_bytes(performance.mesh, "float"), face_bytes(performance.mesh)
    _write_frames(performance, path, ".ply", lambda frame: header + frame.astype("<f4").tobytes() + faces, progress)


def _write_frames(
    performance: Performance,
    folder: Path,
    suffix: str,
    encode: Callable[[NDArray[np.float32]], bytes],
    progress: Progress,
) -> None:
    stem = re.sub(r"[^\w-]+", "_", performance.name) or "frame"
    digits = max(4, len(str(performance.n_frames)))
    _check_replaceable(folder, stem, suffix)
    with folder_aside(folder) as temporary:
        for start, stop in performance.blocks():
            for number, frame in enumerate(performance.read(start, stop), start + 1):
                (temporary / f"{stem}_{number:0{digits}d}{suffix}").write_bytes(encode(frame))
                progress(f"writing {suffix[1:].upper()} files", number, performance.n_frames)


def _check_replaceable(folder: Path, stem: str, suffix: str) -> None:
    """Refuse to replace a folder that holds anything but an earlier export of the same name."""
    ours = re.compile(rf"{re.escape(stem)}_\d+{re.escape(suffix)}")
    others = [file.name for file in folder.iterdir() if not ours.fullmatch(file.name)] if folder.exists() else []
    if others:
        what = f"the folder holds {len(others)} other files, e.g. {min(others)}"
        raise InputError(what, where=folder, remedy="give a new or an empty folder")
