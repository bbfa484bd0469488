"""Do lips and lids that touch on the source touch on the target? Gaps between the two rims of an opening."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.feature_lines import Opening
from toolkit.mesh.closest import closest_on_polyline

__all__ = ["ContactGaps", "contact_gaps", "inner_rim", "rim_gaps"]

Array = NDArray[np.float64]
Frames = Iterable[NDArray[np.floating]]
"""Frames ``(V, 3)`` one after the other; an array ``(T, V, 3)``, memory-mapped or not, is one."""


@dataclass(frozen=True)
class ContactGaps:
    """How well an opening closes where the source's does.

    ``touching`` (T,) how many of the rims' ``vertices`` touch in the source; ``excess`` (T,) the largest gap of these
    on the target beyond what is allowed to stay, as a share of the target's face height (0 where none touches);
    ``mean`` (T,) the mean gap over the whole rim, same unit, ``source_mean`` that of the source in its own height.
    """

    name: str
    vertices: int
    touching: NDArray[np.int64]
    excess: Array
    mean: Array
    source_mean: Array

    @property
    def worst(self) -> float:
        """Largest excess over all frames."""
        return float(self.excess.max(initial=0))

    @property
    def closed_frames(self) -> int:
        """Frames in which at least half of the rims touch in the source (near the corners some always do)."""
        return int(np.count_nonzero(2 * self.touching >= self.vertices))


def inner_rim(opening: Opening) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The vertices of the upper and of the lower rim that are not corners (which both rims share)."""
    return opening.upper[~np.isin(opening.upper, opening.lower)], opening.lower[~np.isin(opening.lower, opening.upper)]


def rim_gaps(opening: Opening, vertices: NDArray[np.floating]) -> Array:
    """Distance of each rim vertex from the opposite rim's line, ``(n,)``, in mesh units: upper ones, then lower ones.

    ``vertices`` (V, 3) of one frame, of the surface that the user sees.
    """
    upper, lower = inner_rim(opening)
    return np.concatenate(
        [_to_polyline(vertices[upper], vertices[opening.lower]), _to_polyline(vertices[lower], vertices[opening.upper])]
    )


def contact_gaps(
    opening: Opening,
    source: Frames,
    target: Frames,
    source_rest: Array,
    target_rest: Array,
    source_height: float,
    target_height: float,
    touching: float = 0.002,
) -> ContactGaps:
    """Measure one opening over a take.

    Parameters
    ----------
    source, target : frames on the same topology, in their own units
    source_rest, target_rest : (V, 3)
    source_height, target_height : heights of the faces, in the same units
    touching : a source gap up to this share of the face height counts as touching

    Where rims touch at rest (lips), the target's own gap at rest may stay; where they are open at rest (lids),
    nothing may.
    """
    at_rest = rim_gaps(opening, source_rest) <= touching * source_height
    allowed = np.where(at_rest, rim_gaps(opening, target_rest), 0.0)
    count, excess, mean, source_mean = [], [], [], []
    for before, after in zip(source, target, strict=True):
        own = rim_gaps(opening, before)
        touches = own <= touching * source_height
        gap = rim_gaps(opening, after)
        count.append(np.count_nonzero(touches))
        excess.append(float(np.max((gap - allowed)[touches], initial=0)) / target_height)
        mean.append(float(gap.mean()) / target_height)
        source_mean.append(float(own.mean()) / source_height)
    return ContactGaps(
        opening.name, len(allowed), np.array(count), np.array(excess), np.array(mean), np.array(source_mean)
    )


def _to_polyline(points: NDArray[np.floating], line: NDArray[np.floating]) -> Array:
    exact = np.asarray(points, dtype=np.float64)
    return np.asarray(np.linalg.norm(closest_on_polyline(exact, np.asarray(line, dtype=np.float64)) - exact, axis=1))
