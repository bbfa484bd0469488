"""Blocks of frames as tasks of a Dask cluster that shares the shot's folder (optional: ``pip install mien[dask]``).

Dask does what there is to do: it hands the tasks to its workers, does those of a lost worker again, and gives up on a
task that has cost several workers. Tasks carry paths and numbers of frames; the frames go through the shared folder.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from threadpoolctl import threadpool_limits

from toolkit.blocks import block_ranges
from toolkit.errors import InputError, MissingDependencyError
from toolkit.progress import Progress, silent

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Cluster"]

_PATIENCE_S = 30
# Blocks in a task: few enough that a lost worker costs little, enough that handing out tasks costs nothing.
_BLOCKS = 4


class Cluster:
    """A connection to a Dask scheduler; to be used in a ``with`` statement.

    ``address`` is the scheduler's, e.g. ``tcp://host:8786``. Every worker needs this software and sees the shot's
    folder and the take under the same paths. Its memory is bounded by the blocks that its threads are doing.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._client = _connect(address)

    def __enter__(self) -> Cluster:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._client.close()

    def check_sees(self, folder: Path) -> None:
        """Raise InputError if there is no worker, or one that does not see ``folder``."""
        seen: dict[str, bool] = self._client.run(_is_folder, str(folder.resolve()))
        if not seen:
            raise InputError("the Dask cluster has no workers", where=self._address, remedy="start some: dask worker")
        blind = [worker for worker, found in seen.items() if not found]
        if blind:
            raise InputError(
                f"{len(blind)} of {len(seen)} Dask workers do not see this folder, e.g. {blind[0]}",
                where=folder,
                remedy="put the shot on a folder that all machines share, under the same path",
            )

    def map_blocks(
        self, work: Callable[[int, int], None], n_frames: int, size: int, *, what: str, progress: Progress = silent
    ) -> None:
        """As `toolkit.blocks.map_blocks`, on the cluster; ``work`` has to be picklable."""
        from distributed import as_completed

        chunks = list(block_ranges(n_frames, _BLOCKS * size))
        # Not "pure": the same call is to be made again in the next run, and what it leaves lies on the disk.
        futures = {self._client.submit(_do_blocks, work, *chunk, size, pure=False): chunk for chunk in chunks}
        try:
            done = 0
            progress(what, done, n_frames)
            for future in as_completed(futures):
                future.result()
                start, stop = futures[future]
                done += stop - start
                progress(what, done, n_frames)
        except BaseException:
            self._client.cancel(list(futures))
            raise


def _do_blocks(work: Callable[[int, int], None], start: int, stop: int, size: int) -> None:
    """The blocks of a chunk, the same as those of a local run, so that rounding is the same, too."""
    _hold_blas()
    for first, last in block_ranges(stop - start, size):
        work(start + first, start + last)


_HELD: list[Any] = []


def _hold_blas() -> None:
    """One BLAS thread for the rest of a worker's life, as in `toolkit.blocks.map_blocks`."""
    if not _HELD:
        _HELD.append(threadpool_limits(1))


def _is_folder(path: str) -> bool:
    return Path(path).is_dir()


def _connect(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingDependencyError(
            f"a Dask cluster needs the package distributed ({error})", remedy="pip install 'mien[dask]'"
        ) from error
    try:
        return Client(address, timeout=_PATIENCE_S)
    except (OSError, ValueError) as error:
        raise InputError(
            f"there is no Dask scheduler that answers ({error})",
            where=address,
            remedy="start one with: dask scheduler, and give its address, e.g. tcp://host:8786",
        ) from error
