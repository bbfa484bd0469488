"""What the two panes show: which surface on the left and on the right, and at which frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from viewer.state.cameras import Framing

__all__ = ["PAIRS", "Pair", "Surface"]


@dataclass(frozen=True, eq=False)
class Surface:
    """A face as displayed.

    ``name`` what it is, ``mesh`` the connectivity's name (source or target), ``vertices`` (V, 3) float32 in its own
    unit and place, ``triangles`` (F, 3) int32, ``framing`` where its face is.
    """

    name: str
    mesh: str
    vertices: NDArray[np.float32]
    triangles: NDArray[np.int32]
    framing: Framing


@dataclass(frozen=True)
class Pair:
    """Two surfaces side by side: names for `App.surface`, titles for the user, and the colour map of the right one."""

    name: str
    words: str
    left: str
    right: str
    titles: tuple[str, str]
    needs: str = ""
    map: str = "none"


PAIRS: dict[str, Pair] = {
    pair.name: pair
    for pair in (
        Pair("performance", "source | target", "source", "result", ("source", "target"), "result"),
        Pair("before_after", "before | after", "before", "result", ("before the edits", "after the edits"), "result"),
        Pair("map", "target | colour map", "result", "result", ("target", "target"), "result", "difference"),
        Pair("references", "neutral faces", "source reference", "target reference", ("source", "target")),
        Pair(
            "registration",
            "target | registered",
            "target reference",
            "registered",
            ("target, as given", "registered: on the source's topology"),
            "registration",
            "distance",
        ),
        Pair("take", "source | target neutral", "source", "target reference", ("source", "target, neutral")),
    )
}
