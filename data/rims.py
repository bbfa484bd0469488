"""Rims that meet: both lids of an eye, both lips, and how the skin round them follows."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from data.layout import LEVELS, Layout

__all__ = ["Opening", "closed_lips", "to_curve"]

Array = NDArray[np.float64]

_RINGS = 2.5
"""How far a correction reaches from the rim, in rings of the mesh."""
_LIP_GAP = 0.015
"""What is left between the lips of a closed mouth, cm."""


class Opening:
    """An eye or the mouth: its rims as rows of the subdivision matrix, and the rings of vertices round it.

    ``follows`` (V, V): by how much each vertex follows the correction of the rim vertex in its column of the rings,
    ``upper_share`` of it (negative) above the opening, the rest below.
    """

    def __init__(self, layout: Layout, rings: str, loop: str, arcs: str, upper_share: float) -> None:
        matrix = layout.subdivision.matrix
        names = (f"{arcs}_upper", f"{arcs}_lower")
        self.upper_ids, self.lower_ids = (layout.arcs[name] for name in names)
        self.upper, self.lower = (matrix[layout.arc(name, LEVELS)] for name in names)
        self.follows = self._follows(layout.rings[rings], layout.loops[loop], upper_share)

    def _follows(self, rings: list[list[int]], loop: list[int], upper_share: float) -> sp.csr_matrix:
        rim = next(k for k, ring in enumerate(rings) if set(ring) == set(loop))
        corners = set(self.upper_ids) & set(self.lower_ids)
        n = self.upper.shape[1]
        follow = sp.lil_matrix((n, n))
        for k, ring in enumerate(rings):
            fade = np.exp(-(((k - rim) / _RINGS) ** 2))
            for vertex, on_rim in zip(ring, rings[rim], strict=True):
                if on_rim not in corners:
                    follow[vertex, on_rim] = fade * (-upper_share if on_rim in self.upper_ids else 1 - upper_share)
        return follow.tocsr()

    def closing(self, points: Array, left_open: float = 0.0) -> Array:
        """Return offsets ``(V, 3)`` that move each rim to the other one's closest points, but for ``left_open`` cm."""
        upper, lower = self.upper @ points, self.lower @ points
        gap = np.zeros_like(points)
        every = 2**LEVELS
        gap[self.upper_ids] = -_shortened(to_curve(upper, lower)[::every], left_open, down=True)
        gap[self.lower_ids] = _shortened(to_curve(lower, upper)[::every], left_open, down=False)
        return np.asarray(self.follows @ gap)


def closed_lips(layout: Layout, neutral: Array) -> Array:
    """Offsets ``(V, 3)`` that close the mouth of a neutral head: at rest the package's lips are 1 to 5 mm apart."""
    mouth = Opening(layout, "mouth", "lip_inner", "lip_inner", 0.5)
    offsets = np.zeros_like(neutral)
    for _ in range(12):
        offsets = offsets + mouth.closing(neutral + offsets, _LIP_GAP)
    return offsets


def to_curve(points: Array, curve: Array) -> Array:
    """Vectors ``(n, 3)`` from ``points`` to their closest points on a polyline ``(m, 3)``."""
    start, along = curve[:-1], np.diff(curve, axis=0)
    at = np.einsum("nmk,mk->nm", points[:, None] - start, along) / np.sum(along**2, axis=1)
    places = start + np.clip(at, 0, 1)[:, :, None] * along
    vectors = places - points[:, None]
    return vectors[np.arange(len(points)), np.argmin(np.sum(vectors**2, axis=2), axis=1)]


def _shortened(vectors: Array, by: float, *, down: bool) -> Array:
    """Make vectors shorter by a length; those that already point the other way grow, so that a gap comes out."""
    if by == 0:
        return vectors
    wanted = np.array([0.0, by if down else -by, 0.0])
    return vectors + wanted
