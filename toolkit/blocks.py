"""Frames in blocks on threads: memory is bounded by the blocks in flight, not by the take."""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import DTypeLike, NDArray
from threadpoolctl import threadpool_limits

from toolkit.progress import Progress, silent

__all__ = ["aligned_empty", "block_ranges", "block_size", "map_blocks", "scratch", "worker_count"]

_BLOCK_BYTES = 256 * 2**20
_CACHE_LINE = 64
_KEPT = threading.local()


def block_size(n_vertices: int) -> int:
    """Frames in a block: 16, fewer where ``(V, 3, 16)`` float32 would pass 256 MB (1.4 million vertices)."""
    return max(1, min(16, _BLOCK_BYTES // (12 * max(n_vertices, 1))))


def block_ranges(n_frames: int, size: int) -> Iterator[tuple[int, int]]:
    """Consecutive ``(start, stop)`` over all frames."""
    for start in range(0, n_frames, size):
        yield start, min(start + size, n_frames)


def worker_count() -> int:
    """Threads to use: the processors that this process may run on, at most 8."""
    return min(8, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (os.cpu_count() or 1))


def scratch(name: str, shape: tuple[int, ...], dtype: DTypeLike = np.float32) -> NDArray:
    """An array with anything in it, which this thread gets again at the next call by that name, shape and type.

    For what a block needs on the way only: new pages for every block take the system as long as a pass over them.
    """
    kept = getattr(_KEPT, name, None)
    if kept is None or kept.shape != shape or kept.dtype != dtype:
        kept = aligned_empty(shape, dtype)
        setattr(_KEPT, name, kept)
    return kept


def aligned_empty(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray:
    """As `np.empty`, beginning on a cache line: vectors of numbers that lie across two take a fifth longer."""
    dtype = np.dtype(dtype)
    size = math.prod(shape) * dtype.itemsize
    memory = np.empty(size + _CACHE_LINE, np.uint8)
    first = -memory.ctypes.data % _CACHE_LINE
    return memory[first : first + size].view(dtype).reshape(shape)


def map_blocks(
    work: Callable[[int, int], None],
    n_frames: int,
    size: int,
    *,
    what: str,
    progress: Progress = silent,
    workers: int | None = None,
) -> None:
    """Call ``work(start, stop)`` for every block, on threads; the compiled kernels release the interpreter lock.

    BLAS is held to one thread each meanwhile: threaded BLAS inside threads is ten times slower. An error in a block, or
    one raised by ``progress`` to cancel, stops the rest and is raised here.
    """
    ranges = list(block_ranges(n_frames, size))
    with threadpool_limits(1), ThreadPoolExecutor(workers or worker_count()) as pool:
        futures = [pool.submit(work, start, stop) for start, stop in ranges]
        try:
            done = 0
            for (start, stop), future in zip(ranges, futures, strict=True):
                future.result()
                done += stop - start
                progress(what, done, n_frames)
        except BaseException:
            for future in futures:
                future.cancel()
            raise
