"""Which part of a mesh is the face, and where eyes, mouth and forehead are, told from named landmarks."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

__all__ = ["CLOSE_UPS", "close_up_vertices", "face_vertices"]

CLOSE_UPS: dict[str, tuple[str, float, float]] = {
    "eyes": (r"eye(?!brow)|lid|canthus", 1.35, 2.4),
    "mouth": (r"lip|mouth|philtrum|labio", 1.5, 1.3),
    "forehead": (r"brow|forehead|glabella|nasion", 1.2, 1.9),
    "features": (r"eye|lid|canthus|brow|nose|nasal|lip|mouth|chin|menton|gnathion|pogonion", 1.15, 0.8),
}
"""Name to (pattern of the landmarks' names, how much larger than their box to show, width / height of the picture)."""
_ENLARGED = 1.3
"""The face itself, beside the box of all its landmarks."""


def face_vertices(rest: NDArray[np.float64], landmarks: Mapping[str, int]) -> NDArray[np.int64] | None:
    """Ids of the vertices (N,) round all ``landmarks`` (name to vertex), so that shoulders do not shrink the face.

    None where there are too few landmarks to tell.
    """
    return _in_box(rest, list(landmarks.values()), _ENLARGED) if len(landmarks) >= 6 else None


def close_up_vertices(name: str, rest: NDArray[np.float64], landmarks: Mapping[str, int]) -> NDArray[np.int64] | None:
    """Ids of the vertices (N,) of a close-up in ``CLOSE_UPS``; None where fewer than three landmarks are named so."""
    pattern, enlarged, _ = CLOSE_UPS[name]
    ids = [vertex for key, vertex in landmarks.items() if re.search(pattern, key.lower())]
    return _in_box(rest, ids, enlarged) if len(ids) >= 3 else None


def _in_box(rest: NDArray[np.float64], ids: list[int], enlarged: float) -> NDArray[np.int64]:
    points = rest[ids]
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = (low + high) / 2, enlarged * (high - low) / 2
    half = np.maximum(half, 0.25 * half.max())  # landmarks of the mouth alone lie nearly in a plane
    inside = np.flatnonzero((np.abs(rest - middle) <= half).all(axis=1))
    return inside if len(inside) else np.asarray(ids, dtype=np.int64)
