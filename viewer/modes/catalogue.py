"""The modes, in the order of their numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewer.modes.base import Mode
from viewer.modes.look import Look

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["make_modes"]


def make_modes(app: App) -> list[Mode]:
    """One of each."""
    return [Look(app)]
