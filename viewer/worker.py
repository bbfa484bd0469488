"""Long work off the main thread: one thread, a queue of jobs, progress, cancel; results are taken by the main thread.

Jobs with a ``slot`` replace the one of the same slot that still waits: while a pointer is dragged only the newest place
is solved for.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from toolkit.errors import InputError
from toolkit.progress import Progress

__all__ = ["Cancelled", "Task", "Worker"]

log = logging.getLogger(__name__)


class Cancelled(Exception):  # noqa: N818  (not an error: the user asked for it)
    """Raised inside a job by its progress callback after the user cancelled it."""


@dataclass
class Task:
    """A job: ``work(progress)`` runs off the main thread, ``done(result)`` or ``failed(error)`` on it.

    ``quiet`` jobs are not shown as progress.
    """

    name: str
    work: Callable[[Progress], Any]
    done: Callable[[Any], None]
    failed: Callable[[Exception], None] | None = None
    slot: str | None = None
    quiet: bool = False
    cancelled: bool = False
    seconds: float = 0.0


class Worker:
    """One thread that does tasks in order; `drain` is called from the main thread's tick."""

    def __init__(self, on_error: Callable[[str, Exception], None] | None = None) -> None:
        self._waiting: deque[Task] = deque()
        self._condition = threading.Condition()
        self._finished: queue.SimpleQueue[tuple[Task, Any, Exception | None]] = queue.SimpleQueue()
        self._current: Task | None = None
        self._open = 0
        self._stopping = False
        self._progress = ("", 0, 0)
        self.on_error = on_error or (lambda name, error: log.error("%s: %s", name, error))
        self._thread = threading.Thread(target=self._run, name="viewer-worker", daemon=True)
        self._thread.start()

    def submit(self, task: Task) -> None:
        """Queue a task; one of the same slot that has not begun is dropped."""
        with self._condition:
            if task.slot is not None:
                kept = deque(t for t in self._waiting if t.slot != task.slot)
                self._open -= len(self._waiting) - len(kept)
                self._waiting = kept
            self._waiting.append(task)
            self._open += 1
            self._condition.notify()

    def cancel(self) -> None:
        """Cancel what is running and drop what waits."""
        with self._condition:
            self._open -= len(self._waiting)
            self._waiting.clear()
            if self._current is not None:
                self._current.cancelled = True

    @property
    def busy(self) -> bool:
        """Whether anything runs, waits, or has not been taken by `drain` yet."""
        return self._open > 0

    @property
    def progress(self) -> tuple[str, int, int] | None:
        """What the running task says: (what, done, total); None where nothing is to be shown."""
        current = self._current
        if current is None or current.quiet:
            return None
        what, done, total = self._progress
        return (what or current.name), done, total

    def drain(self) -> bool:
        """Hand finished results over, on the calling thread; True if there were any."""
        any_done = False
        while True:
            try:
                task, result, error = self._finished.get_nowait()
            except queue.Empty:
                return any_done
            any_done = True
            with self._condition:
                self._open -= 1
            if error is None:
                task.done(result)
            elif task.failed is not None:
                task.failed(error)
            elif not isinstance(error, Cancelled):
                self.on_error(task.name, error)

    def wait(self, seconds: float = 60.0) -> None:
        """Drain until nothing is left to do; for tests and scripts."""
        until = time.monotonic() + seconds
        while self.busy:
            self.drain()
            if time.monotonic() > until:
                raise TimeoutError(f"the worker was still busy after {seconds} s")
            time.sleep(0.002)
        self.drain()

    def stop(self) -> None:
        """Cancel everything and end the thread; does not wait for a job that takes no notice."""
        self.cancel()
        with self._condition:
            self._stopping = True
            self._condition.notify()
        self._thread.join(timeout=2)

    def _run(self) -> None:
        while True:
            with self._condition:
                while not self._waiting and not self._stopping:
                    self._condition.wait()
                if self._stopping:
                    return
                task = self._current = self._waiting.popleft()
                self._progress = ("", 0, 0)
            began = time.perf_counter()
            result: Any = None
            error: Exception | None = None
            try:
                result = task.work(partial(self._told, task))
            except (Cancelled, InputError) as wrong:
                error = wrong
            except Exception as wrong:
                log.exception("%s failed", task.name)
                error = wrong
            task.seconds = time.perf_counter() - began
            with self._condition:
                self._current = None
            self._finished.put((task, result, error))

    def _told(self, task: Task, what: str, done: int, total: int) -> None:
        if task.cancelled:
            raise Cancelled(task.name)
        self._progress = (what, done, total)
