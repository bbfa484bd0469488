"""Large-scale transfer of the bases by deformation gradients, feature lines and contacts (the paper's section 4.2).

Sumner and Popovic's transfer with the fourth vertex eliminated: ``min_x sum_f |(grad_f x - J_f) P_f|^2``, ``P_f`` the
projection on the plane of the target's rest triangle, ``J_f`` the source's deformation gradient. The answer is that of
the 4-vertex form with a third of the unknowns. Feature lines (Eq. 11), contacts and the gauge are further rows of the
same system; it is factorised once and solved for all bases.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.contacts import ContactPairs
from toolkit.errors import InputError
from toolkit.gradient_kernels import add_pulls, add_side_products, invert_edge_frames, put_shapes_innermost
from toolkit.mesh.topology import connected_components, edge_matrix, unique_edges
from toolkit.solve import Factor, factorise

__all__ = [
    "DeformationTransfer",
    "TransferParameters",
    "line_gradients",
]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# Triangles of the meshes for which the paper gives its weight of feature lines.
_PAPER_TRIANGLES = 160_000
# A vertex that moves less than this share of the largest motion of any vertex holds its place.
_STILL = 0.03
_HOLD_WEIGHT = 1e-2
# A triangle with less than this share of the median area has collapsed.
_COLLAPSED = 1e-6


@dataclass(frozen=True)
class TransferParameters:
    """Weights of the large-scale transfer.

    ``feature_lines`` and ``contacts`` switch the two on. ``line_weight`` is the paper's alpha at its density of 160K
    triangles (100 without contacts; with contacts, which do more, about 10); None chooses between the two.
    ``contact_weight`` weighs squared gaps in units of the rim's edge length (3 to 100 do alike). ``robust`` lets
    triangles that deform extremely count less (`DeformationTransfer`); the paper counts all alike.
    """

    feature_lines: bool = True
    contacts: bool = True
    robust: bool = True
    line_weight: float | None = None
    contact_weight: float = 30.0

    def __post_init__(self) -> None:
        if (self.line_weight is not None and self.line_weight < 0) or self.contact_weight < 0:
            raise InputError(
                f"line_weight = {self.line_weight} and contact_weight = {self.contact_weight} cannot be negative",
                remedy="give 0 to switch one off",
            )


class DeformationTransfer:
    """Transfer of the deformed shapes of one smoothed source onto one smoothed target.

    Parameters
    ----------
    source, target : (V, 3) rest shapes on the same triangles, the target brought to the source's pose and size
    triangles : (F, 3)
    moves : (K, V, 3) the source's shapes less its rest shape
    edges : (E, 2) edges of the feature lines
    pairs : contact pairs; their goals are given to `solve`

    The unknowns are displacements from the target's rest shape, so no deformation gives exactly no displacement:
    ``matrix`` (V, V) and ``right`` (V, 3, K), which is all that the shapes ask for but the contacts.

    ``weights`` (F,) is how much each triangle counts: ``1 / (1 + q_f^2)``, ``q_f`` the largest ``|J_f - I|`` of the
    shapes, Frobenius norm; 1 unless ``robust``. In the creases of closed lids and lips a triangle turns over or is
    stretched several times. Such a gradient belongs to the source's own crease, not to the target's; counted in full it
    bends its surroundings, and as positions are sums of gradients, the whole head. On the samples' known answers this
    takes a third off the error of a blink. ``hold`` (V,) is how much each vertex is held at the source's displacement.
    """

    def __init__(
        self,
        source: Array,
        target: Array,
        triangles: NDArray[np.integer],
        moves: NDArray[np.floating],
        edges: Ids | None = None,
        pairs: ContactPairs | None = None,
        parameters: TransferParameters | None = None,
    ) -> None:
        parameters = parameters or TransferParameters()
        self.source, self.target = source, target
        self.pairs = pairs if pairs is not None and parameters.contacts else ContactPairs.none()
        moved, motion = _shapes_innermost(moves)
        self.hold = _gauge(target, triangles, motion)
        self.right = self.hold[:, None, None] * moved
        self.weights = np.empty(len(triangles))
        # The gradients on the target are the first two rows of its inverses.
        inverse, gradients = (_inverse_edge_frames(rest, triangles) for rest in (source, target))
        add_pulls(source, inverse, moved, triangles, gradients, parameters.robust, self.weights, self.right)
        rows = [self._contact_rows(parameters.contact_weight)]
        if edges is not None and parameters.feature_lines:
            rows.append(self._add_lines(edges, moved, self._line_weight(parameters, len(triangles))))
        self.matrix = _normal_matrix(gradients, self.weights, triangles, self.hold, sp.vstack(rows, "csr"))

    @cached_property
    def factor(self) -> Factor:
        """The matrix's factor, made when it is first needed: edits may want that of a nearby matrix instead."""
        return factorise(self.matrix)

    def solve(self, goals: Array | None = None) -> Array:
        """The target's shapes ``(K, V, 3)``; ``goals`` (K, P, 3) the contact pairs' gaps."""
        right = self.right
        if goals is not None:
            right = right.copy()
            right[self.pairs.vertices] += self.contact_pulls(goals)
        return self.shapes(self.factor.solve(_flat(right)))

    def shapes(self, moves: Array, vertices: Ids | slice = slice(None)) -> Array:
        """The target's shapes ``(K, n, 3)`` at some vertices or all, for what was solved for there, ``(n, 3 K)``."""
        return np.asarray(moves.reshape(len(moves), 3, -1).transpose(2, 0, 1) + self.target[vertices])

    def contact_pulls(self, goals: Array) -> Array:
        """What goals (K, P, 3) for the contact pairs' gaps add to ``right`` at the pairs' vertices (U,), (U, 3, K)."""
        pull = self._contact_scale * (goals - self.pairs.gaps(self.target)).transpose(1, 2, 0)
        return np.asarray(self._contacts.T @ _flat(pull)).reshape(len(self.pairs.vertices), *pull.shape[1:])

    def _contact_rows(self, weight: float) -> sp.csr_matrix:
        rim = self.target[self.pairs.edge[:, 1]] - self.target[self.pairs.edge[:, 0]]
        size = float(np.median(np.sqrt(np.sum(rim**2, axis=1)))) if len(rim) else 1.0
        self._contact_scale = np.sqrt(weight) / size
        rows = self._contact_scale * self.pairs.rows(len(self.target))
        self._contacts = rows[:, self.pairs.vertices]
        return rows

    def _line_weight(self, parameters: TransferParameters, n_triangles: int) -> float:
        weight = parameters.line_weight
        if weight is None:
            weight = 10.0 if len(self.pairs) else 100.0
        # Triangles grow with the square of the resolution, edges of a line with the resolution.
        return float(weight * np.sqrt(n_triangles / _PAPER_TRIANGLES))

    def _add_lines(self, edges: Ids, moved: Array, weight: float) -> sp.csr_matrix:
        """The rows (E, V) of the feature lines; what the shapes ask of them is added to ``right``."""
        vectors = self.target[edges[:, 1]] - self.target[edges[:, 0]]
        length = np.maximum(np.sqrt(np.sum(vectors**2, axis=1)), 1e-30)
        direction, scale = vectors / length[:, None], np.sqrt(weight)
        before = self.source[edges[:, 1]] - self.source[edges[:, 0]]
        after = before + (moved[edges[:, 1]] - moved[edges[:, 0]]).transpose(2, 0, 1)
        goals = scale * (line_gradients(before, after, direction) - direction).transpose(1, 2, 0)
        rows = _difference_rows(edges, scale / length, len(self.target))
        ids = np.unique(edges)
        self.right[ids] += (rows[:, ids].T @ _flat(goals)).reshape(len(ids), *goals.shape[1:])
        return rows


def _shapes_innermost(moves: NDArray[np.floating]) -> tuple[Array, Array]:
    """``moves`` (K, V, 3) as ``(V, 3, K)``, and how far each vertex moves at most, ``(V,)``.

    The bases tell it: all frames are sums of them, and what no basis moves no frame of the target moves.
    """
    n_vertices = moves.shape[1]
    innermost, squared = np.empty((n_vertices, 3, len(moves))), np.empty(n_vertices)
    put_shapes_innermost(np.ascontiguousarray(moves), innermost, squared)
    return innermost, np.sqrt(squared)


def _flat(values: Array) -> Array:
    """Values (n, 3, K) as ``(n, 3 K)``, n or K perhaps 0."""
    return values.reshape(len(values), values.shape[1] * values.shape[2])


def _inverse_edge_frames(vertices: Array, triangles: NDArray[np.integer]) -> Array:
    """Inverses ``(F, 3, 3)`` of ``[e0 e1 n]``; zero for collapsed triangles, which have neither gradient nor say."""
    inverse, squared = np.empty((len(triangles), 3, 3)), np.empty(len(triangles))
    invert_edge_frames(vertices, triangles, inverse, squared)
    inverse[squared <= _COLLAPSED**2 * (np.median(squared) if len(squared) else 0)] = 0
    return inverse


def _normal_matrix(
    gradients: Array, weights: Array, triangles: NDArray[np.integer], hold: Array, rows: sp.csr_matrix
) -> sp.csc_matrix:
    """``sum_f w_f (grad_f x)^2 + sum_v hold_v x_v^2 + |rows x|^2`` as a matrix ``(V, V)``.

    A triangle's part is ``w_f g_i . g_j`` at both ends of each of its sides; constants have no gradient, so the rows
    of these parts sum to zero.
    """
    edges = unique_edges(triangles)
    half = edge_matrix(edges, np.zeros(len(edges)), len(hold))
    add_side_products(gradients, weights, triangles, half.indptr, half.indices, half.data)
    ones = np.ones(len(hold))
    few = sp.diags(hold - half @ ones - half.T @ ones) + rows.T @ rows
    # A symmetric matrix by rows is the same by columns.
    return (half + half.T + few).T


def line_gradients(before: Array, after: Array, vectors: Array) -> Array:
    """``D_l vectors_l`` (..., E, 3): the deformation of each feature line's edge, applied to a vector (Eq. 11).

    Eq. 11 is singular as printed. ``D_l`` is read as the smallest rotation that takes the edge at rest, ``before``
    (E, 3), to the deformed edge, ``after`` (..., E, 3), times the ratio of their lengths.
    """
    length = np.maximum(np.sqrt(np.sum(before**2, axis=-1, keepdims=True)), 1e-30)
    new_length = np.maximum(np.sqrt(np.sum(after**2, axis=-1, keepdims=True)), 1e-30)
    u, v = before / length, after / new_length
    axis = np.cross(u, v)
    cosine = np.sum(u * v, axis=-1, keepdims=True)
    # Rodrigues' formula with sin = |axis|; (1 - cos) / sin^2 = 1 / (1 + cos), which fails only at a half turn.
    turned = (
        vectors * cosine
        + np.cross(axis, vectors)
        + axis * np.sum(axis * vectors, axis=-1, keepdims=True) / np.maximum(1 + cosine, 1e-6)
    )
    return np.asarray(turned * (new_length / length))


def _difference_rows(edges: Ids, scale: Array, n_vertices: int) -> sp.csr_matrix:
    rows = np.arange(len(edges))
    values = np.concatenate([scale, -scale])
    cols = np.concatenate([edges[:, 1], edges[:, 0]])
    return sp.csr_matrix((values, (np.tile(rows, 2), cols)), shape=(len(edges), n_vertices))


def _gauge(target: Array, triangles: NDArray[np.integer], motion: Array) -> Array:
    """How much each vertex says where its component is, since gradients do not, ``(V,)``.

    Vertices that the bases hardly move are held softly; a component without any is held at its quietest vertex. In
    both cases the goal is the source's own displacement, which the caller applies.
    """
    n = len(target)
    count, labels = connected_components(triangles, n)
    limit = _STILL * float(motion.max(initial=0))
    stillness = np.clip(1 - (motion / limit) ** 2, 0, None) ** 2 if limit > 0 else np.ones(n)
    still_mass = np.bincount(labels, weights=stillness, minlength=count)
    loose = (still_mass < np.minimum(3, 0.02 * np.bincount(labels, minlength=count)))[labels]
    hold = np.where(loose, 0, _HOLD_WEIGHT * stillness)
    ids = np.flatnonzero(loose)
    by_motion = ids[np.lexsort((motion[ids], labels[ids]))]
    hold[by_motion[np.unique(labels[by_motion], return_index=True)[1]]] = 1
    sides = target.take(triangles[:, 1], axis=0) - target.take(triangles[:, 0], axis=0)
    return np.asarray(hold / float(np.median(np.sqrt(np.einsum("fi,fi->f", sides, sides)))) ** 2)
