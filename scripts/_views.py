"""What the scripts which render have in common: options, and a word about results that are old."""

from __future__ import annotations

import argparse
import logging
from contextlib import suppress
from shlex import quote
from typing import TYPE_CHECKING

from toolkit.errors import InputError

if TYPE_CHECKING:
    from toolkit.shot import Shot

__all__ = ["add_axes", "numbers_list", "positive", "positive_number", "vector", "warn_of_old_result"]

log = logging.getLogger(__name__)


def add_axes(parser: argparse._ActionsContainer) -> None:
    """Which way the source's face looks; on the target the registration tells."""
    parser.add_argument(
        "--forward", type=vector, default=(0.0, 0.0, 1.0), metavar="X,Y,Z", help="out of the source's face (0,0,1)"
    )
    parser.add_argument(
        "--up", type=vector, default=(0.0, 1.0, 0.0), metavar="X,Y,Z", help="up in the source's files (0,1,0)"
    )


def warn_of_old_result(shot: Shot) -> None:
    """Say in the log that the result does not follow the shot's files, parameters or edits any more, if it does not."""
    from toolkit.stages.run import current_key

    with suppress(InputError):  # its files are gone: the result is what there is
        if shot.frames_path.exists() and not shot.is_current("result", current_key(shot, "result")):
            what = "%s: the result is older than the shot's files, parameters or edits; scripts/run_all.py %s renews it"
            log.warning(what, shot.path, quote(str(shot.path)))


def vector(text: str) -> tuple[float, float, float]:
    """Parse ``X,Y,Z``."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not three numbers X,Y,Z") from None
    if x == y == z == 0:
        raise argparse.ArgumentTypeError("a direction cannot be 0,0,0")
    return x, y, z


def positive(text: str) -> int:
    """Parse a whole number above 0."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number above 0")
    return value


def positive_number(text: str) -> float:
    """Parse a finite number above 0."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above 0")
    return value


def numbers_list(text: str) -> list[int]:
    """Parse frame numbers ``0,12,40``."""
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of frame numbers such as 0,12,40") from None
