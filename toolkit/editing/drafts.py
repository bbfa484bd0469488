"""Edits that are tried, and what the journal can hold of them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolkit.editing.stack import State
from toolkit.errors import InputError

__all__ = ["Draft", "plain_data"]


@dataclass(frozen=True, eq=False)
class Draft:
    """An edit that is tried: its ``kind`` and ``data`` for the journal, and the ``state`` that it makes.

    ``instead_of`` is the number of the committed edit that it would change.
    """

    kind: str
    data: dict[str, Any]
    state: State
    instead_of: int | None = None


def plain_data(data: Any) -> dict[str, Any]:
    """Data as it comes back from JSON, so that a draft and its journal line are one and the same."""

    def default(value: Any) -> Any:
        if isinstance(value, np.generic | np.ndarray):
            return value.tolist()
        raise TypeError(f"{type(value).__name__} cannot be written")

    try:
        plain: dict[str, Any] = json.loads(json.dumps(data, default=default, allow_nan=False))
    except (TypeError, ValueError) as error:
        raise InputError(f"the edit cannot be written as JSON ({error})") from error
    return plain
