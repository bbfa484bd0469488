"""Times of calls that are made again and again, and the options that the benchmarks of edits share."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

__all__ = ["Times", "parser_for", "timed"]


@dataclass(frozen=True)
class Times:
    """Seconds of each run: by the clock, and of the processor, to which other work on the machine does not add."""

    wall: tuple[float, ...]
    cpu: tuple[float, ...]

    @property
    def best(self) -> float:
        """The shortest by the clock: what else the machine does only adds to it."""
        return min(self.wall)

    @property
    def best_cpu(self) -> float:
        """The least of the processor."""
        return min(self.cpu)

    @property
    def median(self) -> float:
        """By the clock."""
        return float(np.median(self.wall))

    @property
    def median_cpu(self) -> float:
        """Of the processor."""
        return float(np.median(self.cpu))


def timed(work: Callable[[int], object], runs: int) -> Times:
    """Call ``work`` with the number of the run, 0 to ``runs - 1``."""
    wall, cpu = [], []
    for run in range(runs):
        began, spent = time.perf_counter(), time.process_time()
        work(run)
        wall.append(time.perf_counter() - began)
        cpu.append(time.process_time() - spent)
    return Times(tuple(wall), tuple(cpu))


def parser_for(description: str | None) -> argparse.ArgumentParser:
    """A parser with the sizes of the face and its take."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, default=105_550, help="vertices of the face (default %(default)s)")
    parser.add_argument("--bases", type=int, default=28, help="bases K (default %(default)s)")
    parser.add_argument("--frames", type=int, default=1300, help="frames of the take (default %(default)s)")
    parser.add_argument("--window", type=int, default=100, help="frames of the window (default %(default)s)")
    parser.add_argument("--runs", type=int, default=5, help="runs of each measurement (default %(default)s)")
    parser.add_argument("--json", action="store_true", help="end with one machine-readable line")
    return parser
