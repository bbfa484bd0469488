from __future__ import annotations

import numpy as np
import pytest

from toolkit.contacts import ContactMap, find_contacts
from toolkit.decomposition import Decomposer
from toolkit.feature_lines import Opening
from toolkit.large_scale import transfer_bases
from toolkit.mesh import TriangleMesh, local_frames
from toolkit.transfer import DeformationTransfer, TransferParameters


@pytest.mark.parametrize("contacts", [False, True])
def test_contacts_are_settled_as_by_whole_solves(bump: TriangleMesh, take: np.ndarray, contacts: bool) -> None:
    """Oracle: every round solves for whole faces and takes the details' offsets off all of their surface."""
    grid = np.arange(bump.n_vertices).reshape(24, 31)
    opening = Opening("mouth", grid[6:18, 16], np.r_[grid[6, 16], grid[7:17, 13], grid[17, 16]])
    source, frames = Decomposer(bump), take[[8, 20]]
    target = Decomposer(bump.with_vertices(bump.vertices * [1.2, 0.9, 1.1]))
    pairs = find_contacts([opening], bump.vertices, frames)
    contact_map = ContactMap(pairs, bump.vertices, target.mesh.vertices)
    moves = np.stack([source.filter.smooth(frame) for frame in frames]) - source.rest.smooth
    details = np.random.default_rng(1).normal(0, 0.02, moves.shape)
    gain, gaps = np.linspace(0.8, 1.2, bump.n_vertices), pairs.gaps(frames)
    system = DeformationTransfer(
        source.rest.smooth,
        target.rest.smooth,
        bump.triangles,
        moves,
        pairs=pairs,
        parameters=TransferParameters(contacts=contacts),
    )
    found = transfer_bases(system, target, moves, details[:, system.pairs.vertices], gain, contact_map, gaps)
    bases = system.solve()
    if contacts:
        bases = system.solve(pairs.gaps(target.rest.smooth) + contact_map.change(pairs.gaps(moves)))
        for _ in range(2):
            turns = np.stack([local_frames(b, bump.triangles, target.rest.neighbour) for b in bases])
            visible = np.einsum("kvij,kvj->kvi", turns, target.rest.detail + gain[:, None] * details)
            before, bases = bases, system.solve(contact_map(gaps) - pairs.gaps(visible))
        assert np.abs(bases - before).max() > 1e-6 * bump.diagonal  # the last round changed something
    assert np.abs(found - bases).max() < 1e-10 * bump.diagonal
