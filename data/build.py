"""Build the sample faces into a folder: ``python -m data.build OUT [--level N] [--targets NAME ...]``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from data.samples import build_samples
from data.targets import TARGETS
from toolkit.errors import InputError

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return 0, or 2 on bad input."""
    parser = argparse.ArgumentParser(prog="python -m data.build", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write performer/ and targets/ into")
    parser.add_argument(
        "--level", type=int, default=2, choices=(0, 1, 2), help="2: 68,949 vertices; 1: 17,259; 0: 4,326"
    )
    parser.add_argument(
        "--targets", nargs="*", default=["asian_female", "hound"], metavar="NAME", help=", ".join(TARGETS)
    )
    given = parser.parse_args(arguments)
    try:
        samples = build_samples(given.out, _say, given.targets, given.level)
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write(f"{samples.root}\n")
    return 0


def _say(what: str, done: int, total: int) -> None:
    if done == 0:
        sys.stderr.write(f"{what}\n")


if __name__ == "__main__":
    sys.exit(main())
