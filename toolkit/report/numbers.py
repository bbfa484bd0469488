"""Free-form numbers of the stages as rows of a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolkit.report.glossary import explain

__all__ = ["NumberRow", "format_value", "number_rows"]

_MOST_ITEMS = 8


@dataclass(frozen=True)
class NumberRow:
    """``name`` in words, ``value`` as text, ``judge`` one sentence or nothing, ``verdict`` good, fair, poor or none."""

    name: str
    value: str
    judge: str = ""
    verdict: str = ""


def number_rows(numbers: Mapping[str, Any], judged: bool = True) -> list[NumberRow]:
    """Flatten nested numbers to rows, in order; nested names are joined, what is explained once is not repeated.

    Settings are not ``judged``: a limit is not a finding.
    """
    if not judged:
        return [NumberRow(_in_words(name), format_value(value)) for name, value in _leaves(numbers, "")]
    rows: list[NumberRow] = []
    told: set[str] = set()
    for name, value in _leaves(numbers, ""):
        entry = explain(name)
        judge = "" if entry is None or entry.judge in told else entry.judge
        told.add(judge)
        share = bool(entry and entry.share)
        rows.append(NumberRow(_in_words(name), format_value(value, share=share), judge, _verdict(value, name)))
    return rows


def format_value(value: Any, *, share: bool = False) -> str:
    """Print any value that a manifest may hold in at most a line."""
    if value is None:
        return "–"
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, (int, np.integer)):
        return f"{int(value):,}".replace(",", "\u202f")
    if isinstance(value, (float, np.floating)):
        return _percent(float(value)) if share and np.isfinite(value) else f"{value:.4g}"
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        shown = ", ".join(format_value(item, share=share) for item in value[:_MOST_ITEMS])
        return f"{shown}, … ({len(value)} in all)" if len(value) > _MOST_ITEMS else shown or "none"
    return str(value)


def _percent(share: float) -> str:
    """Below a ten-thousandth of a percent is rounding."""
    return "0 %" if abs(share) < 1e-6 else f"{100 * share:.3g} %"


def _leaves(numbers: Mapping[str, Any], prefix: str) -> list[tuple[str, Any]]:
    leaves: list[tuple[str, Any]] = []
    for key, value in numbers.items():
        name = f"{prefix}{key}"
        leaves += _leaves(value, f"{name}.") if isinstance(value, Mapping) else [(name, value)]
    return leaves


def _in_words(name: str) -> str:
    words = name.replace("_", " ").replace(".", " · ")
    return words[:1].upper() + words[1:]


def _verdict(value: Any, name: str) -> str:
    entry = explain(name)
    number = isinstance(value, (float, np.floating)) and np.isfinite(value)
    if entry is None or entry.good is None or entry.poor is None or not number:
        return ""
    return "good" if value <= entry.good else "fair" if value <= entry.poor else "poor"
