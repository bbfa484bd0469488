"""What a report is made of: plain arrays, numbers and sentences, no files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Chart", "Figure", "ReportData", "Section"]


@dataclass(frozen=True)
class Figure:
    """A picture (h, w, 3) uint8 with its caption; ``wide`` gives it the page's full width."""

    image: NDArray[np.uint8]
    caption: str = ""
    wide: bool = False


@dataclass(frozen=True)
class Chart:
    """A curve or heat map as inline SVG (from ``charts``), with its caption."""

    svg: str
    caption: str = ""


@dataclass(frozen=True)
class Section:
    """One stage of the work. ``numbers`` may nest; each known one is shown with how to judge it (``glossary``).

    ``notes`` are sentences, such as what the input checks found. Where they are settings and no findings they are not
    ``judged``.
    """

    title: str
    intro: str = ""
    figures: Sequence[Figure] = ()
    charts: Sequence[Chart] = ()
    numbers: Mapping[str, Any] = field(default_factory=dict)
    notes: Sequence[str] = ()
    judged: bool = True


@dataclass(frozen=True)
class ReportData:
    """A whole report: ``summary`` of the inputs, ``sections`` in reading order, ``links`` (text, address)."""

    title: str
    subtitle: str = ""
    summary: Mapping[str, Any] = field(default_factory=dict)
    sections: Sequence[Section] = ()
    links: Sequence[tuple[str, str]] = ()
