"""One thing done by us and by a peer: time and accuracy of both."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

__all__ = ["HEAD", "Comparison", "run_limited", "timed"]

HEAD = f"{'what':<26}{'size':<22}{'peer s':>10}{'ours s':>9}{'ratio':>9}{'peer':>13}{'ours':>13}  {'accuracy is'}"


@dataclass(frozen=True)
class Comparison:
    """Seconds of both on the same input, and how far each is off (less is better), in ``unit``.

    ``stopped``: the peer was not done when its time was up; its seconds are then the least that it takes, and how far
    off it would have been is not known.
    """

    name: str
    size: str
    ours_s: float
    peer_s: float
    ours: float
    peer: float
    unit: str
    stopped: bool = False

    @property
    def ratio(self) -> float:
        """How many times faster ours is."""
        return self.peer_s / self.ours_s

    @property
    def ahead(self) -> bool:
        """Whether ours is faster at equal or better accuracy, to a thousandth."""
        return bool(self.ratio > 1 and (self.stopped or self.ours <= 1.001 * self.peer))

    def line(self) -> str:
        """A row of the table."""
        more = ">" if self.stopped else ""
        peer = "stopped" if self.stopped else f"{self.peer:.6g}"
        return (
            f"{self.name:<26}{self.size:<22}{more + format(self.peer_s, '.2f'):>10}{self.ours_s:>9.2f}"
            f"{more + format(self.ratio, '.1f'):>9}{peer:>13}{format(self.ours, '.6g'):>13}  {self.unit}"
            f"{'' if self.ahead else '  NOT AHEAD'}"
        )

    def data(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self) | {"ratio": self.ratio, "ahead": self.ahead}


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """What ``work()`` gives, and its seconds."""
    began = time.perf_counter()
    result = work()
    return result, time.perf_counter() - began


def run_limited(work: Callable[..., Any], arguments: tuple[Any, ...], limit: float) -> tuple[Any, float]:
    """``work(*arguments)`` in a process of its own, with its seconds; None if it takes more than ``limit`` seconds."""
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(sender, work, arguments))
    process.start()
    sender.close()
    try:
        # Starting the process and handing over the input are not the peer's doing: a minute more for them.
        if not receiver.poll(limit + 60):
            return None, limit
        result, seconds = receiver.recv()
    except EOFError:
        raise RuntimeError(f"{work.__name__} failed on {arguments[:1]}; its process says above how") from None
    finally:
        process.kill()
        process.join()
    return (result, seconds) if seconds <= limit else (None, limit)


def _send(sender: Any, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    sender.send(timed(lambda: work(*arguments)))
