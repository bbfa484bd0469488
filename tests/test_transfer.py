from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import lsqr
from scipy.spatial.transform import Rotation

from toolkit.contacts import ContactMap, find_contacts
from toolkit.errors import InputError
from toolkit.feature_lines import FeatureLine, Opening, line_edges
from toolkit.mesh import TriangleMesh
from toolkit.transfer import (
    DeformationTransfer,
    TransferParameters,
    line_gradients,
)

PLAIN = TransferParameters(feature_lines=False, contacts=False, robust=False)


def other_face(mesh: TriangleMesh) -> np.ndarray:
    """The same connectivity on a clearly different rest shape."""
    x, y, z = mesh.vertices.T
    return np.stack([1.3 * x + 0.1 * y, 0.8 * y, 1.5 * z + 0.2 * x * y], axis=1)


def spanned(vertices: np.ndarray, t: np.ndarray) -> np.ndarray:
    a, b, c = vertices[t]
    cross = np.cross(b - a, c - a)
    return np.column_stack([b - a, c - a, cross / np.sqrt(np.linalg.norm(cross))])


def four_vertex_transfer(
    source: np.ndarray, shape: np.ndarray, target: np.ndarray, triangles: np.ndarray
) -> np.ndarray:
    """Sumner and Popovic 2004 as written: a fourth vertex for every triangle, dense least squares, vertex 0 held."""
    n, f = len(source), len(triangles)
    rows, right = np.zeros((3 * f + 1, n + f)), np.zeros((3 * f + 1, 3))
    for k, t in enumerate(triangles):
        wanted = spanned(shape, t) @ np.linalg.inv(spanned(source, t))
        inverse = np.linalg.inv(spanned(target, t))
        for j in range(3):
            # Column j of [x1 - x0, x2 - x0, x4 - x0] inverse.
            rows[3 * k + j, [t[1], t[2], n + k]] += inverse[:, j]
            rows[3 * k + j, t[0]] -= inverse[:, j].sum()
            right[3 * k + j] = wanted[:, j]
    rows[-1, 0] = 1
    right[-1] = target[0]
    return np.linalg.lstsq(rows, right, rcond=None)[0][:n]


def small_patch(bump: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """A corner of the bump, small enough for a dense oracle."""
    near = np.flatnonzero((bump.vertices[:, 0] < -0.2) & (bump.vertices[:, 1] < -0.3))
    position = np.full(bump.n_vertices, -1)
    position[near] = np.arange(len(near))
    kept = (position[bump.triangles] >= 0).all(axis=1)
    return bump.vertices[near], position[bump.triangles[kept]]


def bent(vertices: np.ndarray) -> np.ndarray:
    turn = Rotation.from_rotvec(np.outer(0.8 * vertices[:, 0], [0.2, 1.0, 0.1]))
    return turn.apply(vertices * [1.1, 0.9, 1.2])


def test_equals_the_four_vertex_form(bump: TriangleMesh) -> None:
    source, triangles = small_patch(bump)
    target = other_face(TriangleMesh(source, triangles))
    shape = bent(source)
    slow = four_vertex_transfer(source, shape, target, triangles)
    quick = DeformationTransfer(source, target, triangles, shape[None] - source, parameters=PLAIN).solve()[0]
    quick += (slow - quick).mean(axis=0)  # the position as a whole is the gauge's business
    assert np.abs(quick - slow).max() < 1e-8
    assert np.abs(slow - target).max() > 0.1


def mouth(bump: TriangleMesh) -> tuple[Opening, list[FeatureLine]]:
    """Two rows of the grid as an upper and a lower lip."""
    grid = np.arange(bump.n_vertices).reshape(24, 31)
    upper, lower = grid[6:18, 15], grid[6:18, 14]
    lower = np.concatenate([[upper[0]], lower[1:-1], [upper[-1]]])
    return Opening("mouth", upper, lower), [FeatureLine("upper", False, upper)]


@pytest.mark.parametrize("with_lines", [False, True])
def test_onto_itself_gives_the_source(bump: TriangleMesh, take: np.ndarray, with_lines: bool) -> None:
    shapes = take[[5, 20, 33]]
    opening, lines = mouth(bump)
    pairs = find_contacts([opening], bump.vertices, shapes)
    contact_map = ContactMap(pairs, bump.vertices, bump.vertices)
    given = (line_edges(lines), pairs) if with_lines else ()
    transfer = DeformationTransfer(bump.vertices, bump.vertices, bump.triangles, shapes - bump.vertices, *given)
    result = transfer.solve(contact_map(pairs.gaps(shapes)) if with_lines else None)
    assert np.abs(result - shapes).max() < 1e-9 * bump.diagonal


def test_no_deformation_gives_the_target_exactly(bump: TriangleMesh) -> None:
    target = other_face(bump)
    still = np.zeros((1, bump.n_vertices, 3))
    result = DeformationTransfer(bump.vertices, target, bump.triangles, still).solve()[0]
    assert np.abs(result - target).max() < 1e-12


def test_contacts_close_what_closes(bump: TriangleMesh) -> None:
    """The source's lips meet; the target's opening is twice as high, and meets as well with contacts only."""
    opening, _ = mouth(bump)
    vertices = bump.vertices.copy()
    vertices[opening.lower[1:-1], 1] -= 0.06
    target = vertices * [1.0, 1.0, 1.0]
    target[opening.lower[1:-1], 1] -= 0.05
    closed = vertices.copy()
    closed[opening.lower[1:-1], 1] = vertices[opening.upper[1:-1], 1]
    pairs = find_contacts([opening], vertices, closed[None])
    assert pairs.closes.all()
    goals = ContactMap(pairs, vertices, target)(pairs.gaps(closed[None]))
    gaps = {}
    for contacts in (False, True):
        parameters = TransferParameters(feature_lines=False, contacts=contacts, robust=False)
        moves = closed[None] - vertices
        transfer = DeformationTransfer(vertices, target, bump.triangles, moves, None, pairs, parameters)
        gaps[contacts] = np.linalg.norm(pairs.gaps(transfer.solve(goals if contacts else None)[0]), axis=1)
    rest = np.linalg.norm(pairs.gaps(target), axis=1)
    assert gaps[True].max() < 0.1 * rest.mean()
    assert gaps[False].max() > 0.25 * rest.mean()


def test_contact_map_keeps_the_rest_and_zero(bump: TriangleMesh) -> None:
    opening, _ = mouth(bump)
    target = other_face(bump)
    closed = bump.vertices.copy()
    closed[opening.lower[1:-1]] = closed[opening.upper[1:-1]]
    pairs = find_contacts([opening], bump.vertices, closed[None])
    contact_map = ContactMap(pairs, bump.vertices, target)
    assert np.allclose(contact_map(pairs.gaps(bump.vertices)), pairs.gaps(target), atol=1e-14)
    rest = np.linalg.norm(pairs.gaps(target), axis=1)
    assert (np.linalg.norm(contact_map(np.zeros((len(pairs), 3))), axis=1) < 0.06 * rest).all()


def test_pairs_are_nearest_points(bump: TriangleMesh) -> None:
    opening, _ = mouth(bump)
    pairs = find_contacts([opening], bump.vertices, np.zeros((0, bump.n_vertices, 3)))
    for p in range(len(pairs)):
        other = opening.lower if pairs.vertex[p] in opening.upper else opening.upper
        rim = bump.vertices[other]
        along = np.linspace(0, 1, 400)[:, None]
        dense = np.concatenate([a + along * (b - a) for a, b in pairwise(rim)])
        nearest = np.linalg.norm(dense - bump.vertices[pairs.vertex[p]], axis=1).min()
        assert np.linalg.norm(pairs.gaps(bump.vertices)[p]) == pytest.approx(nearest, abs=1e-4)


def test_feature_lines_keep_their_shape(bump: TriangleMesh) -> None:
    """With a large weight the target's line deforms as the source's edges do."""
    _, lines = mouth(bump)
    edges = line_edges(lines)
    target, shape = other_face(bump), bent(bump.vertices)
    errors = []
    for weight in (0.0, 1e6):
        parameters = TransferParameters(contacts=False, robust=False, line_weight=weight)
        moves = shape[None] - bump.vertices
        result = DeformationTransfer(
            bump.vertices, target, bump.triangles, moves, edges, parameters=parameters
        ).solve()[0]
        before, after, rest = (x[edges[:, 1]] - x[edges[:, 0]] for x in (bump.vertices, shape, target))
        wanted = line_gradients(before, after, rest)
        errors.append(np.abs(result[edges[:, 1]] - result[edges[:, 0]] - wanted).max())
    assert errors[1] < 1e-3 * errors[0]


def test_line_gradient_is_a_rotation_and_a_stretch() -> None:
    rng = np.random.default_rng(1)
    edge, new_edge, other = rng.normal(size=(3, 10, 3))
    assert np.allclose(line_gradients(edge, new_edge, edge), new_edge)
    ratio = np.linalg.norm(new_edge, axis=1) / np.linalg.norm(edge, axis=1)
    turned = line_gradients(edge, new_edge, other)
    assert np.allclose(np.linalg.norm(turned, axis=1), ratio * np.linalg.norm(other, axis=1))
    axis = np.cross(edge, new_edge)
    assert np.allclose(line_gradients(edge, new_edge, axis), ratio[:, None] * axis)
    several = line_gradients(edge, np.stack([edge, new_edge]), other)
    assert np.allclose(several, [other, turned])


def test_parts_stay_with_the_face(bump: TriangleMesh) -> None:
    """A loose part that moves as a whole, such as lower teeth, moves by as much; a still one stays."""
    n = bump.n_vertices
    rest = np.concatenate([bump.vertices, 0.2 * bump.vertices + [0, 0, -1], 0.2 * bump.vertices + [0, 1, -1]])
    triangles = np.concatenate([bump.triangles, bump.triangles + n, bump.triangles + 2 * n])
    shape = rest.copy()
    shape[:n] = rest[:n] + np.outer(np.clip(-rest[:n, 1], 0, None), [0, -0.3, 0])
    shape[n : 2 * n] += [0, -0.3, 0.05]
    target = rest * [1.2, 0.9, 1.1]
    moved = DeformationTransfer(rest, target, triangles, shape[None] - rest, parameters=PLAIN).solve()[0] - target
    assert np.allclose(moved[n : 2 * n], [0, -0.3, 0.05], atol=1e-9)
    assert np.abs(moved[2 * n :]).max() < 1e-9


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize("collapsed", ["", "source", "target"])
def test_the_normal_equations_are_those_of_the_energy(bump: TriangleMesh, robust: bool, collapsed: str) -> None:
    """Oracle by another solver: the rows of every triangle, stacked and solved iteratively.

    A triangle without an area on the source says that nothing is deformed there; one on the target says nothing.
    """
    source, triangles = small_patch(bump)
    target, shape = other_face(TriangleMesh(source, triangles)), bent(source)
    flat = 5
    for name, rest in (("source", source), ("target", target)):
        if name == collapsed:
            a, b, c = triangles[flat]
            rest[c] = 0.4 * rest[a] + 0.6 * rest[b]
    transfer = DeformationTransfer(
        source, target, triangles, shape[None] - source, parameters=replace(PLAIN, robust=robust)
    )
    n, strength = len(source), np.sqrt(transfer.hold)[:, None]
    assert transfer.hold.any()
    assert (np.ptp(transfer.weights) > 0.1) == robust
    rows, right = [strength * np.eye(n)], [strength * (shape - source)]
    for f, t in enumerate(triangles):
        if collapsed == "target" and f == flat:
            continue
        edges = target[t[1:]] - target[t[0]]
        gradient = np.zeros((3, n))
        gradient[:, t[1:]] = np.linalg.pinv(edges)
        gradient[:, t[0]] = -gradient[:, t[1:]].sum(axis=1)
        still = collapsed == "source" and f == flat
        change = np.zeros((3, 3)) if still else spanned(shape, t) @ np.linalg.inv(spanned(source, t)) - np.eye(3)
        rows.append(np.sqrt(transfer.weights[f]) * gradient)
        right.append(np.sqrt(transfer.weights[f]) * change.T)
    system, goals = sp.csr_matrix(np.concatenate(rows)), np.concatenate(right)
    result = transfer.solve()[0] - target
    for c in range(3):
        slow = lsqr(system, goals[:, c], atol=1e-14, btol=1e-14, iter_lim=20000)[0]
        assert np.abs(result[:, c] - slow).max() < 1e-7


def test_extreme_triangles_count_less(bump: TriangleMesh) -> None:
    def weights(shapes: np.ndarray, rest: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        return DeformationTransfer(rest, rest, triangles, shapes - rest).weights

    half_turn = Rotation.from_rotvec([0, 0, np.pi]).apply(bump.vertices)
    assert np.allclose(weights(bump.vertices[None], bump.vertices, bump.triangles), 1)
    # |J - I|^2 of a half turn is 4 + 4; the largest of all shapes counts.
    assert np.allclose(weights(np.stack([half_turn, bump.vertices]), bump.vertices, bump.triangles), 1 / 9)
    flat = np.array([[0, 0, 0.0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 2, 0]])
    triangles = np.array([[0, 1, 2], [1, 3, 2], [0, 3, 4]], dtype=np.int32)  # the last has no area
    stretched = 1 / (1 + 2**2 + (np.sqrt(3) - 1) ** 2)  # normals grow with the root of the area
    assert np.allclose(weights(flat[None] * [1, 3, 1], flat, triangles), [stretched, stretched, 1])


def test_a_crumpled_spot_bends_its_surroundings_less(bump: TriangleMesh) -> None:
    """A line of the source folds over itself; away from it nothing moves, and the target's skin should not either."""
    x, y, _ = bump.vertices.T
    fold = np.exp(-(((x - 0.1) / 0.12) ** 2) - ((y + 0.1) / 0.3) ** 2)
    shape = bump.vertices + np.stack([-2.5 * (x - 0.1) * fold, 0.2 * fold, 0.3 * fold], axis=1)
    target = other_face(bump)
    far = np.hypot(x - 0.1, y + 0.1) > 0.7
    moved = []
    for robust in (False, True):
        moves, parameters = shape[None] - bump.vertices, replace(PLAIN, robust=robust)
        transfer = DeformationTransfer(bump.vertices, target, bump.triangles, moves, parameters=parameters)
        moved.append(np.sqrt(np.mean((transfer.solve()[0] - target)[far] ** 2)))
    assert moved[1] < 0.9 * moved[0]


def test_bad_weights() -> None:
    with pytest.raises(InputError, match="contact_weight = -1"):
        TransferParameters(contact_weight=-1)
