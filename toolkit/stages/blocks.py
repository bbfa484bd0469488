"""Work on blocks of frames that other processes, here or on other machines, can take up too.

The frame stages fill large arrays in the stage's folder, block by block, through a `MapBlocks`: threads of this process
(`toolkit.blocks.map_blocks`) or a Dask cluster (`toolkit.cluster.Cluster`). A block's bytes do not depend on who
computes it, nor on how often.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import scratch
from toolkit.progress import Progress, silent

__all__ = ["Fill", "MapBlocks", "StageBlocks"]

Fill = Callable[..., None]
"""``fill(start, stop, *blocks)`` writes frames ``start <= t < stop`` into blocks ``(B, ...)``, one for each array."""


class MapBlocks(Protocol):
    """Calls ``work(start, stop)`` for all blocks of ``size`` frames, each at least once; returns when all are done."""

    def __call__(
        self, work: Callable[[int, int], None], n_frames: int, size: int, *, what: str, progress: Progress = silent
    ) -> None:
        """``what`` is said to ``progress`` with the frames done."""


@dataclass
class StageBlocks:
    """A stage's work on blocks; it pickles as the paths from which another process opens it again.

    ``arrays`` are the names of what is filled, in the folder that the stage is being written to. ``opener(shot,
    folder)`` makes ``fill`` from the two folders: a function at the top of a module.
    """

    arrays: tuple[str, ...]
    opener: Callable[[Path, Path], Fill]
    shot: Path
    folder: Path
    fill: Fill | None = None

    def __post_init__(self) -> None:
        self._maps = [np.lib.format.open_memmap(self.folder / f"{name}.npy", mode="r") for name in self.arrays]

    def __call__(self, start: int, stop: int) -> None:
        """Do one block."""
        fill = self.fill
        if fill is None:
            with _ONE_AT_A_TIME:
                fill = _opened(self.opener, self.shot, self.folder)
        shapes = [(stop - start, *array.shape[1:]) for array in self._maps]
        blocks = [
            scratch(f"stage {k}", shape, a.dtype) for k, (shape, a) in enumerate(zip(shapes, self._maps, strict=True))
        ]
        fill(start, stop, *blocks)
        for array, block in zip(self._maps, blocks, strict=True):
            _write(array, start, block, to_disk=self.fill is None)

    def __getstate__(self) -> dict[str, Any]:
        paths = {"shot": self.shot.resolve(), "folder": self.folder.resolve()}
        return {"arrays": self.arrays, "opener": self.opener, "fill": None, **paths}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= state
        self.__post_init__()


def _write(array: np.memmap, start: int, block: NDArray[Any], *, to_disk: bool) -> None:
    """Write a block where ``array`` has frames from ``start`` on; ``to_disk`` waits until it lies there.

    Through the file, not the map: machines that map the same page of a file on a network overwrite each other's part,
    and a page written for the first time through a map costs a fault.
    """
    with open(str(array.filename), "r+b") as file:
        file.seek(array.offset + start * array[:1].nbytes)
        file.write(block.data)
        if to_disk:
            file.flush()
            os.fsync(file.fileno())


# Every task brings its own copy; what it opens is kept for the next ones. A stage's folder has a new name each time.
_ONE_AT_A_TIME = threading.Lock()


@lru_cache(maxsize=1)
def _opened(opener: Callable[[Path, Path], Fill], shot: Path, folder: Path) -> Fill:
    return opener(shot, folder)
