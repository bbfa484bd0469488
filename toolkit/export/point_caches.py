"""Exact frames without faces: PC2, MDD and NumPy, written block by block."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from toolkit.export.performance import Performance
from toolkit.meshio.aside import written_aside
from toolkit.meshio.npy import write_blocks
from toolkit.meshio.point_caches import MDD_HEADER, PC2_HEADER
from toolkit.progress import Progress

__all__ = ["write_mdd", "write_npy", "write_pc2"]


def write_pc2(performance: Performance, path: Path, progress: Progress) -> None:
    """Write a PC2 point cache: little-endian, one sample a frame, starting at frame 0."""
    header = np.zeros((), dtype=PC2_HEADER)
    header["magic"], header["version"], header["rate"] = b"POINTCACHE2", 1, 1
    header["points"], header["frames"] = performance.n_vertices, performance.n_frames
    with written_aside(path) as temporary, temporary.open("wb") as file:
        file.write(header.tobytes())
        _write_frames(performance, file, "<f4", "writing PC2", progress)


def write_mdd(performance: Performance, path: Path, progress: Progress) -> None:
    """Write an MDD point cache: big-endian, with the time of each frame in seconds."""
    header = np.zeros((), dtype=MDD_HEADER)
    header["points"], header["frames"] = performance.n_vertices, performance.n_frames
    times = np.arange(performance.n_frames) / performance.fps
    with written_aside(path) as temporary, temporary.open("wb") as file:
        file.write(header.tobytes() + times.astype(">f4").tobytes())
        _write_frames(performance, file, ">f4", "writing MDD", progress)


def write_npy(performance: Performance, path: Path, progress: Progress) -> None:
    """Write an array ``(T, V, 3)`` float32."""
    shape = (performance.n_frames, performance.n_vertices, 3)
    with written_aside(path) as temporary:
        write_blocks(temporary, shape, "<f4", _frames(performance, "writing NumPy array", progress))


def _write_frames(performance: Performance, file: BinaryIO, dtype: str, what: str, progress: Progress) -> None:
    for block in _frames(performance, what, progress):
        file.write(np.ascontiguousarray(block, dtype=dtype).data)


def _frames(performance: Performance, what: str, progress: Progress) -> Iterator[NDArray[np.float32]]:
    for start, stop in performance.blocks():
        yield performance.read(start, stop)
        progress(what, stop, performance.n_frames)
