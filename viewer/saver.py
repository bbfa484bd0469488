"""Small files written off the main thread: on a loaded disk the flush that makes a file safe takes frames' time."""

from __future__ import annotations

import logging
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor, wait

__all__ = ["Saver"]

log = logging.getLogger(__name__)


class Saver:
    """One thread that writes in the order asked for; of what waits to be written to one place only the newest is.

    Who reads such a file, or lets another process read it, calls `flush` first; so does who ends the process.
    """

    def __init__(self, on_error: Callable[[BaseException], None] | None = None) -> None:
        self.on_error = on_error or (lambda error: log.error("not saved: %s", error))
        self._thread = ThreadPoolExecutor(1, "viewer-saver")
        self._asked: dict[Hashable, tuple[Future[None], Callable[[], None]]] = {}

    def save(self, place: Hashable, write: Callable[[], None], done: Callable[[], None] = lambda: None) -> None:
        """Call ``write()`` in the thread, then ``done()`` in `drain`; an earlier ``place`` not begun yet is dropped."""
        if place in self._asked:
            self._asked[place][0].cancel()
        self._asked[place] = self._thread.submit(write), done

    @property
    def busy(self) -> bool:
        """Whether anything is not on disk, or not told by `drain` yet."""
        return bool(self._asked)

    def flush(self) -> None:
        """Wait until everything is on disk; may be called from any thread."""
        wait([future for future, _ in list(self._asked.values())])

    def drain(self) -> None:
        """Say on the calling thread what is done and what went wrong."""
        over = [place for place, (future, _) in self._asked.items() if future.done()]
        for future, done in [self._asked.pop(place) for place in over]:
            error = future.exception()
            if error is None:
                done()
            else:
                self.on_error(error)
