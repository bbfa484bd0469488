"""Who computes the frames: threads here, or a Dask cluster. Options that the scripts which run shots have in common."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from toolkit.stages.blocks import MapBlocks

__all__ = ["add_workers", "frame_workers"]


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add ``--jobs`` and ``--dask``."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--jobs",
        type=_positive,
        metavar="N",
        help="blocks of frames to work on at once, one thread and about 500 MB each (default: processors, at most 8)",
    )
    group.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="let the workers of this Dask scheduler, e.g. tcp://host:8786, work on the frames; they have to see the "
        "shot and the take under the same paths",
    )


@contextmanager
def frame_workers(options: argparse.Namespace, shots: Sequence[Path]) -> Iterator[MapBlocks]:
    """What `run_stages` takes as ``map_blocks``; a cluster is checked to see the shots' folders first."""
    from toolkit.blocks import map_blocks

    if options.dask is None:
        yield partial(map_blocks, workers=options.jobs)
        return
    from toolkit.cluster import Cluster

    with Cluster(options.dask) as cluster:
        for shot in shots:
            cluster.check_sees(shot)
        yield cluster.map_blocks


def _positive(text: str) -> int:
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of jobs such as 4")
    return int(text)
