"""Bases on the target whose contacts hold on the surface that the user sees.

Lips and lids must meet on the detailed surface, but the transfer solves for the smoothed one. The difference, the
detail's own offset at a contact pair, depends on the solution only through the turning of local frames round the pairs,
so a few solves there settle it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.contacts import ContactMap
from toolkit.decomposition import Decomposer
from toolkit.mesh.geometry import local_frames
from toolkit.mesh.patch import FramePatch
from toolkit.progress import Progress, silent
from toolkit.solve import PulledSolve
from toolkit.transfer import DeformationTransfer

__all__ = ["LocalDetails", "transfer_bases"]

Array = NDArray[np.float64]

_ROUNDS = 2


class LocalDetails:
    """Detail displacements at a few vertices (n,) of the target; ``patch`` is what they depend on."""

    def __init__(self, target: Decomposer, vertices: NDArray[np.integer]) -> None:
        self.patch = FramePatch.around(np.asarray(target.mesh.triangles), target.rest.neighbour, vertices)
        self._own = target.rest.detail[vertices]

    def displacement(self, shape: Array, detail: Array) -> Array:
        """``G (e_0' + detail)`` (n, 3) at the vertices, for a smoothed shape of the patch (m, 3) and details (n, 3)."""
        frames = local_frames(shape, self.patch.triangles, self.patch.neighbour)[self.patch.at]
        return np.asarray(np.einsum("vij,vj->vi", frames, self._own + detail))


def transfer_bases(
    system: DeformationTransfer,
    target: Decomposer,
    moves: NDArray[np.floating],
    details: NDArray[np.floating],
    gain: Array,
    contact_map: ContactMap,
    source_gaps: Array,
    progress: Progress = silent,
) -> Array:
    """The target's smoothed bases ``(K, V, 3)``.

    ``moves`` (K, V, 3) are those of the smoothed source that ``system`` was made with, ``details`` (K, U, 3) its motion
    details in the same frames at the contact pairs' vertices, ``gain`` (V,) their factor, ``source_gaps`` (K, P, 3) the
    gaps of the visible source, ``contact_map`` what they become on the target.
    """
    pairs = system.pairs
    if not len(pairs) or not len(moves):
        return system.solve()
    ids, n_vertices = pairs.vertices, len(system.target)
    local, gap = LocalDetails(target, ids), pairs.rows(n_vertices)[:, ids]
    patch = local.patch
    moved = details * gain[ids, None]
    solving = PulledSolve(system.factor, system.right.reshape(n_vertices, -1), patch.ids)

    def pulls(goals: Array) -> Array:
        placed = np.zeros((len(patch.ids), 3, len(goals)))
        placed[patch.at] = system.contact_pulls(goals)
        return placed.reshape(len(placed), -1)

    # Begin with the smoothed surfaces' own contacts; on the source itself that is the answer.
    goals = pairs.gaps(system.target) + contact_map.change(pairs.gaps(moves))
    for done in range(_ROUNDS):
        progress("transferring bases", done, _ROUNDS)
        shapes = system.shapes(solving.at_unknowns(pulls(goals)), patch.ids)
        offsets = [gap @ local.displacement(shape, detail) for shape, detail in zip(shapes, moved, strict=True)]
        goals = contact_map(source_gaps) - np.stack(offsets)
    bases = system.shapes(solving.everywhere(pulls(goals)))
    progress("transferring bases", _ROUNDS, _ROUNDS)
    return bases
