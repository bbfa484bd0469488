"""What a section reports: measured values beside their goals, as a table and as plain data."""

from __future__ import annotations

import operator
import textwrap
from dataclasses import asdict, dataclass
from typing import Any

__all__ = ["Row", "Section", "at_least", "at_most", "measured", "table"]


@dataclass(frozen=True)
class Row:
    """One measured value; ``goal`` and ``passed`` are None where it is only printed."""

    name: str
    value: float
    unit: str = ""
    goal: str | None = None
    passed: bool | None = None


@dataclass(frozen=True)
class Section:
    """A section's rows, and what its numbers are, in a sentence or two."""

    name: str
    about: str
    rows: tuple[Row, ...]

    def plain(self) -> dict[str, Any]:
        """As plain data for JSON."""
        return {"about": self.about, "rows": [asdict(row) for row in self.rows]}


def measured(name: str, value: float, unit: str = "") -> Row:
    """A value without a goal."""
    return Row(name, float(value), unit)


def at_most(name: str, value: float, goal: float, unit: str = "") -> Row:
    """A value that should not exceed its goal."""
    return _judged(name, value, goal, unit, "<=")


def at_least(name: str, value: float, goal: float, unit: str = "") -> Row:
    """A value that should reach its goal."""
    return _judged(name, value, goal, unit, ">=")


def _judged(name: str, value: float, goal: float, unit: str, sign: str) -> Row:
    holds = operator.le if sign == "<=" else operator.ge
    return Row(name, float(value), unit, f"{sign} {goal:.4g}", bool(holds(float(value), goal)))


def table(section: Section) -> str:
    """The section as aligned text."""
    width = max((len(row.name) for row in section.rows), default=0)
    about = textwrap.wrap(section.about, 110, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False)
    lines = ["", section.name.upper(), *about, ""]
    for row in section.rows:
        value = f"{row.value:.4g} {row.unit}".strip()
        mark = "" if row.passed is None else ("PASS" if row.passed else "FAIL")
        lines.append(f"  {row.name:<{width}}  {value:>14}  {row.goal or '':>10}  {mark}".rstrip())
    return "\n".join(lines)
