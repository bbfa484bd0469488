"""Bases on the target whose contacts hold on the surface that the user sees.

Lips and lids must meet on the detailed surface, but the transfer solves for the smoothed one. The difference, the
detail's own offset at a contact pair, depends on the solution only through the turning of local frames, so a few
substitutions with the same factor settle it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.contacts import ContactMap, ContactPairs
from toolkit.decomposition import Decomposer
from toolkit.mesh.geometry import local_frames
from toolkit.mesh.patch import FramePatch
from toolkit.progress import Progress, silent
from toolkit.transfer import DeformationTransfer

__all__ = ["LocalDetails", "transfer_bases"]

Array = NDArray[np.float64]

_ROUNDS = 2


class LocalDetails:
    """Detail displacements at a few vertices of the target, for whole shapes."""

    def __init__(self, target: Decomposer, vertices: NDArray[np.integer]) -> None:
        self._patch = FramePatch.around(np.asarray(target.mesh.triangles), target.rest.neighbour, vertices)
        self._own = target.rest.detail[vertices]
        self.vertices = vertices

    def displacement(self, shape: Array, detail: Array) -> Array:
        """``G (e_0' + detail)`` (n, 3) at the vertices, for a smoothed shape (V, 3) and details (n, 3) there."""
        patch = self._patch
        frames = local_frames(shape[patch.ids], patch.triangles, patch.neighbour)[patch.at]
        return np.asarray(np.einsum("vij,vj->vi", frames, self._own + detail))


def transfer_bases(
    system: DeformationTransfer,
    target: Decomposer,
    shapes: Array,
    details: NDArray[np.floating],
    gain: Array,
    pairs: ContactPairs,
    contact_map: ContactMap,
    source_gaps: Array,
    progress: Progress = silent,
) -> Array:
    """Transfer the smoothed source shapes ``(K, V, 3)``; returns the target's smoothed bases ``(K, V, 3)``.

    ``details`` (K, V, 3) are the source's motion details in the same frames, ``gain`` (V,) their factor,
    ``source_gaps`` (K, P, 3) the gaps of the visible source, ``contact_map`` what they become on the target.
    """
    right = system.right_hand_sides(shapes)
    if not system.has_contacts or not len(shapes):
        return system.solve_for(right)
    ids = pairs.vertices
    local = LocalDetails(target, ids)
    spread = np.zeros_like(target.rest.smooth)
    moved = np.asarray(details[:, ids], dtype=np.float64) * gain[ids, None]
    # Begin with the smoothed surfaces' own contacts; on the source itself that is the answer.
    smooth_change = pairs.gaps(shapes) - pairs.gaps(system.source)
    first_goals = pairs.gaps(system.target) + contact_map.change(smooth_change)
    bases = system.solve_for(system.with_contacts(right, first_goals))
    goals = contact_map(source_gaps)
    for done in range(_ROUNDS):
        progress("transferring bases", done, _ROUNDS)
        offsets = np.empty_like(goals)
        for k, basis in enumerate(bases):
            spread[ids] = local.displacement(basis, moved[k])
            offsets[k] = pairs.gaps(spread)
        bases = system.solve_for(system.with_contacts(right, goals - offsets))
    progress("transferring bases", _ROUNDS, _ROUNDS)
    return bases
