"""Details carried from one part of the skin to another: a linear map, the same in every frame.

Both parts lie flat in one plane. Each vertex of the goal takes what the source has at the same place; what lies in the
skin is turned from one local frame to the other, what stands on it is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.detail_edit.flatten import FlatPatch, located
from toolkit.detail_edit.region import Region

__all__ = ["Carrier", "carrier"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Ids = NDArray[np.int64]

_COARSER = 1.2


@dataclass(frozen=True, eq=False)
class Carrier:
    """The map: ``source`` (n,) vertices to read, ``goal`` the vertices to write with how much each takes hold.

    ``across`` (g, n) complex acts on the tangent and bitangent parts as one number, ``up`` (g, n) on the normal part;
    ``mirrored`` first turns bitangents round.
    """

    source: Ids
    goal: Region
    across: sp.csr_matrix
    up: sp.csr_matrix
    mirrored: bool

    def carry(self, details: NDArray[np.floating]) -> NDArray[np.float32]:
        """Details of the source ``(m, n, 3)`` as they come to lie at the goal ``(m, g, 3)``."""
        flat = details[..., 0] + 1j * details[..., 1]
        if self.mirrored:
            flat = flat.conj()
        moved = (self.across @ flat.T).T
        raised = (self.up @ details[..., 2].T).T
        return np.stack([moved.real, moved.imag, raised], axis=-1).astype(np.float32)


def carrier(
    source: FlatPatch,
    bent: Complex,
    region: Region,
    goal: FlatPatch,
    neighbours: tuple[Ids, Ids],
    size: float,
    mirrored: bool = False,
) -> Carrier:
    """The map from a source patch to a goal patch.

    ``bent`` (n,) where the source's vertices go in the goal's plane; ``region`` which of them count, with its weights;
    ``neighbours`` of the source's and the goal's local frames, each (V,); ``size`` factor of the details' depth.
    """
    held = _at(region, source.vertices)
    moved, known = _tangents(bent, source.vertices, neighbours[0])
    used = source.triangles[(held[source.triangles] > 0).any(axis=1)]
    used = used[known[used].all(axis=1)]
    if mirrored:
        used = used[:, ::-1]
    own, ready = _tangents(goal.places, goal.vertices, neighbours[1])
    taken = _samples(bent, used, goal)
    strength = np.where(ready, taken @ held, 0)
    rows = np.flatnonzero(strength > 1e-6)
    up = sp.csr_matrix(size * taken[rows])
    # Into the plane by the tangent as it lies after the bend (or the mirror), out of it by the goal's own.
    across = sp.csr_matrix(sp.diags(own[rows].conj()) @ up @ sp.diags(moved))
    return Carrier(source.vertices, Region(goal.vertices[rows], np.minimum(strength[rows], 1)), across, up, mirrored)


def _samples(bent: Complex, used: Ids, goal: FlatPatch) -> sp.csr_matrix:
    """What each vertex of the goal takes of the source's vertices, ``(g, n)``; an empty row where there is no source.

    Where the goal's mesh is coarser, half of it comes from round the vertex: single points of a wrinkle that is hardly
    wider than an edge would make beads of it.
    """
    n = len(bent)
    taken = _sampling(bent, used, goal.places, n)
    there = np.diff(taken.indptr) > 0
    ends = np.concatenate([goal.triangles[:, [0, 1]], goal.triangles[:, [1, 2]], goal.triangles[:, [2, 0]]])
    ends = np.concatenate([ends, ends[:, ::-1]])
    ends = ends[there[ends[:, 0]]]
    if len(ends) == 0:
        return taken
    way = goal.places[ends[:, 1]] - goal.places[ends[:, 0]]
    if np.median(np.abs(way)) < _COARSER * np.median(np.abs(bent[used[:, 0]] - bent[used[:, 1]])):
        return taken
    beside = _sampling(bent, used, goal.places[ends[:, 0]] + way / 3, n)
    missing = np.diff(beside.indptr) == 0
    beside = beside + sp.diags(missing.astype(float)) @ taken[ends[:, 0]]
    count = np.maximum(np.bincount(ends[:, 0], minlength=len(goal.places)), 1)
    gather = sp.csr_matrix((0.5 / count[ends[:, 0]], (ends[:, 0], np.arange(len(ends)))), (len(goal.places), len(ends)))
    return sp.csr_matrix(0.5 * taken + gather @ beside)


def _sampling(bent: Complex, used: Ids, queries: Complex, n: int) -> sp.csr_matrix:
    triangle, weights = located(bent, used, queries)
    rows = np.flatnonzero(triangle >= 0)
    at = (np.repeat(rows, 3), used[triangle[rows]].ravel())
    return sp.csr_matrix((weights[rows].ravel(), at), shape=(len(queries), n))


def _tangents(places: Complex, vertices: Ids, neighbour: Ids) -> tuple[Complex, NDArray[np.bool_]]:
    """Direction in the plane of each vertex's tangent ``(n,)``, and whether its neighbour is in the patch."""
    wanted = neighbour[vertices]
    found = np.minimum(np.searchsorted(vertices, wanted), len(vertices) - 1)
    known = vertices[found] == wanted
    edge = places[found] - places
    length = np.abs(edge)
    known &= length > 0
    return edge / np.where(length > 0, length, 1), known


def _at(region: Region, vertices: Ids) -> Array:
    """The region's weights at some vertices ``(n,)``."""
    held = np.zeros(len(vertices))
    if len(region):
        found = np.minimum(np.searchsorted(region.vertices, vertices), len(region) - 1)
        same = region.vertices[found] == vertices
        held[same] = region.weights[found[same]]
    return held
