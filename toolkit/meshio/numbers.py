"""Numbers out of text, as fast as NumPy reads them, with the faults found by their line."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["parse_floats", "parse_integers", "vertex_ids"]

# What the Microsoft C runtime writes for not-a-number and infinity, e.g. 1.#QNAN, -1.#IND00, -nan(ind).
_MICROSOFT_NAN = re.compile(rb"(?i)[^\s,]*(?:#(?:ind|qnan|snan)|nan\()\S*")
_MICROSOFT_INF = re.compile(rb"(?i)[^\s,]*#inf\S*")


def parse_floats(text: bytes, expected: int) -> NDArray[np.float64] | None:
    """Read ``expected`` whitespace-separated numbers ``(expected,)``; NaN stays NaN; None where that fails."""
    values = _parse(text, np.float64, expected)
    if values is None and (b"#" in text or b"(" in text):
        plain = _MICROSOFT_INF.sub(b"inf", _MICROSOFT_NAN.sub(b"nan", text))
        values = _parse(plain, np.float64, expected)
    return values


def parse_integers(text: bytes, expected: int) -> NDArray[np.int64] | None:
    """Read ``expected`` whitespace-separated integers ``(expected,)``; None where that fails."""
    return _parse(text, np.int64, expected)


def vertex_ids(values: Iterable[Any], what: str) -> NDArray[np.int64]:
    """Vertex ids ``(n,)`` from a JSON file; ``what`` one of them is, for the ValueError where one is none."""
    ids = list(values)
    for value in ids:
        # NumPy would cut 1.5 down to 1 and take true for 1.
        if isinstance(value, bool) or not isinstance(value, int) or abs(value) > np.iinfo(np.int64).max:
            raise ValueError(f"{what} is {value!r}, no vertex id")
    return np.array(ids, dtype=np.int64)


def _parse(text: bytes, dtype: type, expected: int) -> NDArray | None:
    with warnings.catch_warnings():
        # Older NumPy warns and returns what it understood; newer NumPy raises. The count settles both.
        warnings.simplefilter("ignore", DeprecationWarning)
        try:
            values: NDArray = np.fromstring(text, dtype=dtype, sep=" ")
        except ValueError:
            return None
    return values if len(values) == expected else None
