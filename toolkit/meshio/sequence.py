"""Frames of a performance, read a block at a time: a take may be larger than memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.meshio.aside import written_aside
from toolkit.meshio.npy import write_blocks
from toolkit.progress import Progress, silent

__all__ = ["USUAL_FPS", "FrameSequence", "cache_as_npy", "checked_fps", "frame_blocks"]

USUAL_FPS = 30.0
"""Frames a second where neither the file nor the user says."""
_BLOCK_BYTES = 64 * 2**20


@dataclass(frozen=True)
class FrameSequence:
    """A take: ``n_frames`` frames of the same ``n_vertices`` vertices, in the file's unit.

    ``fps`` frames a second, None where neither the file nor the user says; ``where`` the file, for messages;
    ``triangles`` (F, 3) int32 if the file carries faces, else None; ``read_block(start, stop)`` is the format's own
    reader, called through `read`.
    """

    n_frames: int
    n_vertices: int
    fps: float | None
    where: str
    read_block: Callable[[int, int], NDArray]
    triangles: NDArray[np.int32] | None = None

    def __post_init__(self) -> None:
        if self.n_frames < 1 or self.n_vertices < 1:
            raise InputError(
                f"the take has {self.n_frames} frames of {self.n_vertices} vertices",
                where=self.where,
                remedy="export it again, with its animation and its geometry",
            )

    @property
    def rate(self) -> float:
        """Frames a second; the usual ones where it is not known."""
        return float(self.fps or USUAL_FPS)

    def __len__(self) -> int:
        return self.n_frames

    def read(self, start: int, stop: int, vertices: NDArray[np.integer] | None = None) -> NDArray[np.float32]:
        """Return frames ``start <= t < stop`` as ``(stop - start, V, 3)`` float32, a copy of the caller's own.

        With ``vertices`` (n,) only these, ``(stop - start, n, 3)``.
        """
        block = self._block(start, stop)
        return np.array(block if vertices is None else block[:, vertices], dtype=np.float32, order="C")

    def view(self, start: int, stop: int) -> NDArray[np.float32]:
        """Return frames as `read` does, but nobody may write to them: they may be the file itself, mapped."""
        return np.asarray(self._block(start, stop), dtype=np.float32, order="C")

    def _block(self, start: int, stop: int) -> NDArray:
        if not 0 <= start <= stop <= self.n_frames:
            raise IndexError(f"frames {start}:{stop} are outside 0:{self.n_frames} of {self.where}")
        if start == stop:
            return np.zeros((0, self.n_vertices, 3), dtype=np.float32)
        return self.read_block(start, stop)

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Yield ``(start, stop)`` over all frames, in blocks of about 64 MB."""
        return frame_blocks(self.n_frames, self.n_vertices)


def frame_blocks(n_frames: int, n_vertices: int) -> Iterator[tuple[int, int]]:
    """Yield ``(start, stop)`` over ``n_frames`` frames, in blocks of about 64 MB of float32 positions."""
    step = max(1, _BLOCK_BYTES // (n_vertices * 12))
    for start in range(0, n_frames, step):
        yield start, min(start + step, n_frames)


def cache_as_npy(sequence: FrameSequence, path: str | Path, progress: Progress = silent) -> FrameSequence:
    """Copy a take to a ``.npy`` file ``(T, V, 3)`` float32, block by block, and return it memory-mapped from there.

    For takes that are slow to read (folders of OBJ, Alembic): they are read, and thereby checked, once.
    """
    shape = (sequence.n_frames, sequence.n_vertices, 3)
    with written_aside(path) as temporary:
        write_blocks(temporary, shape, np.float32, _read_through(sequence, progress))
    mapped = np.load(path, mmap_mode="r")
    return FrameSequence(*shape[:2], sequence.fps, str(path), lambda a, b: mapped[a:b], sequence.triangles)


def _read_through(sequence: FrameSequence, progress: Progress) -> Iterator[NDArray[np.float32]]:
    for start, stop in sequence.blocks():
        yield sequence.view(start, stop)
        progress("reading frames", stop, sequence.n_frames)


def checked_fps(fps: float | None, where: object) -> float | None:
    """Return ``fps``, or raise InputError if it is no frame rate."""
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise InputError(
            f"{fps} frames a second is no frame rate", where=where, remedy="give a positive number, e.g. 30"
        )
    return fps
