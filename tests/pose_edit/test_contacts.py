from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolkit.contacts import ContactPairs
from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.pose_edit import EditableTake, EditParameters, PointConstraint, PoseEditor, TouchingPairs

KEY = 18
CLOSED = slice(15, 23)
ROW = 31  # vertices of a row of the patch


def slit(upper: int, lower: int, columns: range) -> ContactPairs:
    """Pairs from one row of the patch to another, as lids would have them; corners at the rows' ends."""
    vertex = np.array([upper * ROW + c for c in columns])
    edge = np.stack([lower * ROW + np.array(columns), lower * ROW + np.array(columns) + 1], axis=1)
    corners = np.tile([upper * ROW + columns[0] - 1, upper * ROW + columns[-1] + 2], (len(vertex), 1))
    return ContactPairs(vertex, edge, np.full(len(vertex), 0.3), np.ones(len(vertex), bool), corners)


@pytest.fixture
def blinking(face: EditableTake) -> EditableTake:
    pairs = slit(16, 22, range(4, 12))
    touching = np.zeros((face.n_frames, len(pairs)))
    touching[CLOSED] = 1
    return replace(face, contacts=TouchingPairs(pairs, touching))


def opened(take: EditableTake, before: EditableTake) -> np.ndarray:
    """How far each frame's pairs have moved against each other, (T,)."""
    assert before.contacts is not None
    gaps = [[before.contacts.pairs.gaps(x.smooth_frame(t)) for t in range(x.n_frames)] for x in (take, before)]
    return np.linalg.norm(np.subtract(*gaps), axis=2).max(axis=1)


def pull(take: EditableTake, x: float = 0.3, y: float = -0.6) -> PointConstraint:
    vertex = int(np.argmin(((take.rest[:, :2] - [x, y]) ** 2).sum(axis=1)))
    return PointConstraint(KEY, vertex, offset=(0.0, -0.03, -0.1))


@pytest.mark.parametrize("mode", ["both", "weights"])
def test_weights_leave_closed_what_is_closed(bump: TriangleMesh, blinking: EditableTake, mode: str) -> None:
    editor, asked = PoseEditor(blinking, bump.triangles), [pull(blinking)]
    found = []
    for contacts in (0.0, 1.0, 100.0):
        parameters = EditParameters(mode=mode, window=(4, 40), contacts=contacts)
        edit = editor.solve(asked, parameters)
        only_weights = replace(blinking, weights=edit.weights)
        found.append(opened(only_weights, blinking)[CLOSED].max())
        if mode == "both":  # what the weights may not do, the bases do
            assert edit.residuals[0].left < 0.01 * edit.residuals[0].asked
    assert found[1] < (0.1 if mode == "both" else 0.5) * found[0]
    assert found[2] < 0.1 * found[1]


def test_zero_and_no_contacts_are_the_same(bump: TriangleMesh, face: EditableTake, blinking: EditableTake) -> None:
    plain = PoseEditor(face, bump.triangles).solve([pull(face)], EditParameters(window=(8, 28)))
    without = PoseEditor(blinking, bump.triangles).solve([pull(face)], EditParameters(window=(8, 28), contacts=0))
    assert plain.weights.tobytes() == without.weights.tobytes()
    with pytest.raises(InputError, match="contacts = -1"):
        EditParameters(contacts=-1)


def test_who_pulls_at_the_rim_may_open_it(bump: TriangleMesh, blinking: EditableTake) -> None:
    editor = PoseEditor(blinking, bump.triangles)
    pairs = blinking.contacts.pairs
    parameters = EditParameters(mode="weights", window=(8, 28))
    on_the_rims = {int(pairs.vertex[3]): True, int(pairs.edge[2, 0]): True, int(pairs.corners[0, 0]): False}
    for vertex, free in on_the_rims.items():
        at = PointConstraint(KEY, vertex, offset=(0.02, 0.02, 0.05))
        kept, let = (editor.solve([at], replace(parameters, contacts=c)).weights for c in (1.0, 0.0))
        assert (kept.tobytes() == let.tobytes()) is free


def test_the_cost_is_that_of_each_basis_alone(blinking: EditableTake) -> None:
    contacts = blinking.contacts
    joined = zip(_columns(contacts.pairs), _columns(slit(3, 5, range(8, 20))), strict=True)
    two = ContactPairs(*(np.concatenate(x) for x in joined))
    rng = np.random.default_rng(4)
    both = TouchingPairs(two, rng.uniform(0, 1, (blinking.n_frames, len(two))))
    found = both.touching[5:10] @ both.opened_by(blinking.moves_at(two.vertices))
    gaps = two.gaps(blinking.moves)  # (K, P, 3)
    share = np.where(np.arange(len(two)) < len(contacts.pairs), 1 / len(contacts.pairs), 1 / 12)
    for n, t in enumerate(range(5, 10)):
        for k in range(blinking.n_bases):
            assert found[n, k] == pytest.approx(float((both.touching[t] * share) @ (gaps[k] ** 2).sum(axis=1)))
    assert found.shape == (5, blinking.n_bases)


def _columns(pairs: ContactPairs) -> tuple[np.ndarray, ...]:
    return pairs.vertex, pairs.edge, pairs.share, pairs.closes, pairs.corners


def test_touching_is_told_by_the_sources_gaps(face: EditableTake) -> None:
    pairs = slit(14, 17, range(4, 7))
    width = pairs.widths(face.rest)[0]
    gaps = np.zeros((4, 3, 3))
    gaps[:, :, 1] = width * np.array([0.0, 0.02, 0.03, 0.05])[:, None]
    touching = TouchingPairs.by_gaps(pairs, gaps, face.rest).touching
    assert touching == pytest.approx(np.array([1, 1, 0.5, 0])[:, None] * np.ones(3))
