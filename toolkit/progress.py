"""Progress as a plain callback, so that the toolkit knows neither terminals nor windows."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["Progress", "silent"]

Progress = Callable[[str, int, int], None]
"""``progress(what, done, total)``: called from time to time during long work; raise from it to cancel."""


def silent(what: str, done: int, total: int) -> None:
    """Report nothing."""
