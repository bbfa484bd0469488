"""How well a registration went, in numbers that need no known answer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.mesh import TriangleMesh, triangle_areas
from toolkit.registration.folds import agreement, backwards
from toolkit.registration.nonrigid import SheetedSurface
from toolkit.registration.surface import Hits

__all__ = ["RegistrationQuality", "flipped_triangles", "share", "stretched_triangles", "wrong_sheet"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_STRETCHED = 6.0


@dataclass(frozen=True)
class RegistrationQuality:
    """Numbers of a registration; lengths are shares of the landmarks' extent, about a face's height.

    ``distance_median_share``, ``distance_95_share``: of the skin to the target's surface.
    ``landmark_median_share``, ``landmark_worst_share``, ``landmark_worst``: their residuals, and whose is worst.
    ``flipped_share``: of the skin's triangles, folded onto a neighbour or with the back to the outside.
    ``wrong_sheet_share``: of the vertices near lips and lids, nearer to the other one; None without feature lines on
    both faces.
    ``stretched_share``: of the skin's triangles, an area changed 6 times more, or less, than usual.
    ``misfit``: RMS residual of the landmarks' similarity, how unlike the two faces are.
    ``accepted_share``: of the skin, found its place on the target.
    """

    distance_median_share: float
    distance_95_share: float
    landmark_median_share: float
    landmark_worst_share: float
    landmark_worst: str
    flipped_share: float
    wrong_sheet_share: float | None
    stretched_share: float
    misfit: float
    accepted_share: float


def flipped_triangles(source: TriangleMesh, vertices: Array, hits: Hits, skin: Mask) -> Mask:
    """Mask ``(F,)`` of the skin's triangles that the registration turned over.

    Either folded onto the neighbours (the normal opposes those of its vertices, and did not in the source), or lying
    on the target's surface, where that is not an edge, with the back to the outside. ``hits`` are all vertices'.
    """
    triangles = source.triangles
    areas = triangle_areas(source.vertices, triangles)
    candidates = skin[triangles].all(axis=1) & (areas > 1e-4 * np.median(areas))
    folded = (agreement(vertices, triangles) < 0) & (agreement(source.vertices, triangles) > 0)
    return candidates & (folded | backwards(vertices, triangles, hits.normals))


def wrong_sheet(
    vertices: Array, labels: Mapping[str, NDArray[np.int8]], surface: SheetedSurface, hits: Hits, tolerance: float
) -> tuple[Mask, Mask]:
    """Masks ``(V,)`` of the vertices on the wrong lip or lid, and of all that were judged.

    Wrong is a vertex whose own sheet is farther than the target's nearest point by more than ``tolerance``.
    """
    judged = np.zeros(len(vertices), dtype=bool)
    for values in labels.values():
        judged |= values != 0
    own = surface.closest(vertices[judged], {name: values[judged] for name, values in labels.items()})
    wrong = np.zeros(len(vertices), dtype=bool)
    wrong[judged] = own.distance > hits.distance[judged] + tolerance
    return wrong, judged


def stretched_triangles(source: TriangleMesh, vertices: Array, skin: Mask) -> Mask:
    """Mask ``(F,)`` of skin triangles whose area changed 6 times more, or less, than the skin's median."""
    candidates = skin[source.triangles].all(axis=1)
    before = triangle_areas(source.vertices, source.triangles)
    candidates &= before > 1e-4 * np.median(before)
    ratio = triangle_areas(vertices, source.triangles) / np.maximum(before, 1e-300)
    typical = np.median(ratio[candidates]) if candidates.any() else 1.0
    return candidates & ((ratio > _STRETCHED * typical) | (ratio * _STRETCHED < typical))


def share(mask: Mask, among: Mask) -> float:
    """Share of ``among`` that is in ``mask``; 0 of nothing."""
    return float(np.count_nonzero(mask & among)) / max(int(np.count_nonzero(among)), 1)
