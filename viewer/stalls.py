"""How long the window stood still: each time that the main loop calls us is measured until it has its thread back."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any, TypeVar

__all__ = ["FREEZE", "Stall", "StallWatch"]

log = logging.getLogger(__name__)

FREEZE = 0.1
"""Seconds after which a hand notices that the window stands still."""

T = TypeVar("T")


@dataclass(frozen=True)
class Stall:
    """How long one call took: ``wall`` seconds by the clock, ``own`` less the time in which others had the processor.

    ``own`` is what an idle machine would show: work, and waiting for locks and disks. It is the clock's where the
    system does not tell (only Linux does). ``cpu`` is the work alone.
    """

    wall: float
    own: float
    cpu: float


class StallWatch:
    """Keeps the longest call of each kind, since it was last told to `begin`."""

    def __init__(self) -> None:
        self.longest: dict[str, Stall] = {}
        self._left: Stall | None = None

    def begin(self) -> None:
        """Forget what was before."""
        self.longest.clear()
        self._left = None

    def timed(self, kind: str, call: Callable[..., T]) -> Callable[..., T]:
        """``call`` as it is, measured as one of a ``kind``; what the main loop does in between counts as "loop"."""

        def measured(*arguments: Any) -> T:
            began = _now()
            if self._left is not None:
                self._keep("loop", self._left, began)
            try:
                return call(*arguments)
            finally:
                self._left = _now()
                self._keep(kind, began, self._left)

        return measured

    def _keep(self, kind: str, began: Stall, ended: Stall) -> None:
        taken = Stall(ended.wall - began.wall, ended.own - began.own, ended.cpu - began.cpu)
        known = self.longest.get(kind, taken)
        self.longest[kind] = Stall(*map(max, astuple(known), astuple(taken)))
        if taken.own > FREEZE:
            log.info("%s: %.0f ms, %.0f ms on its own account", kind, 1e3 * taken.wall, 1e3 * taken.own)


def _now() -> Stall:
    wall = time.perf_counter()
    return Stall(wall, wall - _queued(), time.thread_time())


def _queued() -> float:
    """Seconds that this thread was ready to run and had to wait for a processor, since it began."""
    try:
        with open("/proc/thread-self/schedstat", encoding="ascii") as file:
            return 1e-9 * int(file.read().split()[1])
    except OSError:
        return 0.0
