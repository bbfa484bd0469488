"""The part of a mesh that local frames at some vertices depend on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["FramePatch"]

Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FramePatch:
    """The triangles round some vertices (k,), and the neighbours of their frames, in a numbering of their own.

    ``ids`` (n,) the patch's vertices on the mesh, ascending; ``triangles`` (f, 3) and ``neighbour`` (n,) in places of
    ``ids``; ``at`` (k,) where the asked vertices stand there. Local frames of the patch are the mesh's own at these;
    elsewhere triangles are missing.
    """

    ids: Ids
    triangles: NDArray[np.integer]
    neighbour: NDArray[np.integer]
    at: Ids

    @classmethod
    def around(
        cls, triangles: NDArray[np.integer], neighbour: NDArray[np.integer], vertices: NDArray[np.integer]
    ) -> FramePatch:
        """Cut it out of a mesh with ``triangles`` (F, 3) and the frames' ``neighbour`` (V,)."""
        inside = np.zeros(len(neighbour), dtype=bool)
        inside[vertices] = True
        a, b, c = triangles.T
        near = triangles[inside[a] | inside[b] | inside[c]]
        inside[near] = True
        inside[neighbour[vertices]] = True
        number = np.cumsum(inside) - 1
        ids, at = np.flatnonzero(inside), number[vertices]
        own = np.zeros(len(ids), dtype=np.int64)
        own[at] = number[neighbour[vertices]]
        return cls(ids, number[near].astype(triangles.dtype), own.astype(neighbour.dtype), at)
