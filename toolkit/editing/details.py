"""Where edits of details join the stack."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from toolkit.details import DetailsChange
from toolkit.editing.opening import OpenedTake
from toolkit.errors import InputError

__all__ = ["solve_detail"]


def solve_detail(edit: Mapping[str, Any] | Any, opened: OpenedTake, changes: Sequence[DetailsChange]) -> DetailsChange:
    """Solve a detail edit, given as data or as such, on the details that earlier ``changes`` left."""
    raise InputError("edits of details are not available in this version")
