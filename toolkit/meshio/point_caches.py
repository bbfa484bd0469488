"""Frames without faces: NumPy arrays and the point caches PC2 and MDD. Memory-mapped, except ``.npz``."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.meshio.joined import frame_rate_of
from toolkit.meshio.sequence import FrameSequence

__all__ = ["MDD_HEADER", "PC2_HEADER", "open_mdd", "open_npy", "open_npz", "open_pc2"]

PC2_HEADER = np.dtype(
    [("magic", "S12"), ("version", "<i4"), ("points", "<i4"), ("start", "<f4"), ("rate", "<f4"), ("frames", "<i4")]
)
"""PC2: the magic word, then little-endian numbers; ``rate`` is in samples a frame, not a second."""

MDD_HEADER = np.dtype([("frames", ">i4"), ("points", ">i4")])
"""MDD: two big-endian integers, then the time of each frame in seconds, then the positions, all big-endian."""

_SHAPE = "save one array of shape (frames, vertices, 3)"


def open_npy(path: Path, fps: float | None) -> FrameSequence:
    """Open an array ``(T, V, 3)``, memory-mapped."""
    frames = _load(path, lambda: np.load(path, mmap_mode="r", allow_pickle=False))
    return _of_array(frames, fps, path)


def open_npz(path: Path, fps: float | None) -> FrameSequence:
    """Open the array named ``frames``, or the only array of shape (T, V, 3), of an archive; it is read whole."""
    with _load(path, lambda: np.load(path, allow_pickle=False)) as archive:
        name = "frames" if "frames" in archive.files else _only_frames(archive, path)
        frames = _load(path, lambda: archive[name])
    return _of_array(frames, fps, path)


def open_pc2(path: Path, fps: float | None) -> FrameSequence:
    """Open a PC2 point cache, memory-mapped. It does not say its frame rate."""
    header = _header(path, PC2_HEADER)
    if header["magic"] != b"POINTCACHE2":
        raise InputError(
            "is not a PC2 point cache: its first bytes are not POINTCACHE2",
            where=path,
            remedy="export it again, or name it after its own format",
        )
    return _map(path, "<f4", PC2_HEADER.itemsize, int(header["frames"]), int(header["points"]), fps)


def open_mdd(path: Path, fps: float | None) -> FrameSequence:
    """Open an MDD point cache, memory-mapped; without ``fps`` the frame rate is taken from its times."""
    header = _header(path, MDD_HEADER)
    n_frames, n_points = int(header["frames"]), int(header["points"])
    offset = MDD_HEADER.itemsize + 4 * n_frames
    sequence = _map(path, ">f4", offset, n_frames, n_points, fps)
    if fps is not None:
        return sequence
    times = np.fromfile(path, dtype=">f4", count=n_frames, offset=MDD_HEADER.itemsize).astype(np.float64)
    return replace(sequence, fps=frame_rate_of(times))


def _header(path: Path, dtype: np.dtype) -> NDArray:
    with path.open("rb") as file:
        data = file.read(dtype.itemsize)
    if len(data) < dtype.itemsize:
        raise InputError(f"has {len(data)} bytes, less than a header", where=path, remedy="export the cache again")
    return np.frombuffer(data, dtype=dtype)[0]


def _map(path: Path, dtype: str, offset: int, n_frames: int, n_points: int, fps: float | None) -> FrameSequence:
    if n_frames < 1 or n_points < 1:
        what = f"the header says {n_frames} frames of {n_points} points"
        raise InputError(what, where=path, remedy="export the cache again, with its animation")
    present = (path.stat().st_size - offset) // (12 * n_points)
    if present < n_frames:
        what = f"the header says {n_frames} frames of {n_points} points, but the file holds {max(present, 0)}"
        raise InputError(what, where=path, remedy="it is cut short, copy or export it again")
    return _mapped(path, np.dtype(dtype), offset, (n_frames, n_points), fps)


def _mapped(path: Path, dtype: np.dtype, offset: int, shape: tuple[int, int], fps: float | None) -> FrameSequence:
    """Frames ``(T, V, 3)`` from ``offset`` on; only blocks in use are mapped: no process holds all of a take."""
    n_frames, n_points = shape
    size = 3 * n_points * dtype.itemsize

    def read_block(start: int, stop: int) -> NDArray:
        block = (stop - start, n_points, 3)
        return np.memmap(path, dtype=dtype, mode="r", offset=offset + start * size, shape=block)

    return FrameSequence(n_frames, n_points, fps, str(path), read_block)


def _load(path: Path, load: Callable[[], Any]) -> Any:
    try:
        return load()
    except (ValueError, EOFError, OSError, KeyError, zipfile.BadZipFile) as error:
        what = f"cannot be read as a NumPy file ({str(error).rstrip('.')})"
        raise InputError(what, where=path, remedy="it is damaged or cut short, save it again") from error


def _only_frames(archive: np.lib.npyio.NpzFile, path: Path) -> str:
    names = [name for name in archive.files if archive[name].ndim == 3 and archive[name].shape[2] == 3]
    if len(names) != 1:
        what = f"has {len(names)} arrays of shape (frames, vertices, 3) among {', '.join(archive.files) or 'nothing'}"
        raise InputError(what, where=path, remedy="name the one to use 'frames'")
    return names[0]


def _of_array(frames: NDArray, fps: float | None, path: Path) -> FrameSequence:
    if not isinstance(frames, np.ndarray) or frames.ndim != 3 or frames.shape[2] != 3:
        raise InputError(f"has an array of shape {getattr(frames, 'shape', ())}", where=path, remedy=_SHAPE)
    if frames.dtype.kind not in "fiu":
        raise InputError(f"has an array of type {frames.dtype}, not of numbers", where=path, remedy=_SHAPE)
    if isinstance(frames, np.memmap) and frames.flags.c_contiguous:
        return _mapped(path, frames.dtype, frames.offset, frames.shape[:2], fps)
    return FrameSequence(frames.shape[0], frames.shape[1], fps, str(path), lambda start, stop: frames[start:stop])
