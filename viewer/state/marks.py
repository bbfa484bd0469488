"""What is drawn on top of a face: discs, curves, numbers. In the displayed mesh's unit and place; sizes in pixels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["BLUE", "GREEN", "GREY", "ORANGE", "RED", "WHITE", "YELLOW", "Curve", "Disc", "Mark", "Text"]

Color = tuple[float, float, float]

BLUE: Color = (0.25, 0.66, 1.0)
ORANGE: Color = (1.0, 0.56, 0.12)
YELLOW: Color = (1.0, 0.86, 0.25)
GREEN: Color = (0.35, 0.85, 0.45)
RED: Color = (1.0, 0.32, 0.28)
WHITE: Color = (0.96, 0.96, 0.97)
GREY: Color = (0.62, 0.64, 0.67)


@dataclass(frozen=True)
class Disc:
    """A disc with a dark rim at ``position`` (3,)."""

    position: tuple[float, float, float]
    color: Color = BLUE
    radius: float = 5.0
    text: str = ""


@dataclass(frozen=True)
class Curve:
    """A polyline through ``points`` (n, 3); ``width`` in pixels."""

    points: NDArray[np.floating]
    color: Color = ORANGE
    width: float = 2.5
    closed: bool = False


@dataclass(frozen=True)
class Text:
    """Words at ``position`` (3,)."""

    position: tuple[float, float, float]
    text: str
    color: Color = WHITE


Mark = Disc | Curve | Text
