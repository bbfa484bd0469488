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
from toolkit.gradient_kernels import add_pulls, invert_edge_frames, largest_changes
from toolkit.mesh.topology import connected_components
from toolkit.solve import Factor, factorise

__all__ = [
    "DeformationTransfer",
    "TransferParameters",
    "largest_motion",
    "line_gradients",
    "triangle_weights",
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
    triangles that deform extremely count less (`triangle_weights`); the paper counts all alike.
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
    """Transfer of deformations of one smoothed source onto one smoothed target, ready for any number of shapes.

    Parameters
    ----------
    source, target : (V, 3) rest shapes on the same triangles, the target brought to the source's pose and size
    triangles : (F, 3)
    edges : (E, 2) edges of the feature lines
    pairs : contact pairs; their goals are given to `solve`
    motion : (V,) how far each vertex of the source moves at most; the still ones hold the gauge
    weights : (F,) how much each triangle counts, all alike by default

    The unknowns are displacements from the target's rest shape, so no deformation gives exactly no displacement.
    """

    def __init__(
        self,
        source: Array,
        target: Array,
        triangles: NDArray[np.integer],
        motion: Array,
        edges: Ids | None = None,
        pairs: ContactPairs | None = None,
        parameters: TransferParameters | None = None,
        weights: Array | None = None,
    ) -> None:
        parameters = parameters or TransferParameters()
        self.source, self.target, self.triangles = source, target, triangles
        self._inverse = _inverse_edge_frames(source, triangles)
        # The gradients on the target are the first two rows of its inverses.
        self._gradients = _inverse_edge_frames(target, triangles)
        self._weights = weights if weights is not None else np.ones(len(triangles))
        self._edges = edges if edges is not None and parameters.feature_lines else np.zeros((0, 2), dtype=np.int64)
        self._pairs = pairs if pairs is not None and parameters.contacts and len(pairs) else None
        self._held, self._hold = _gauge(target, triangles, motion)
        hold = sp.csr_matrix((self._hold, (self._held, self._held)), shape=(len(target), len(target)))
        rows = sp.vstack([self._line_rows(parameters), self._contact_rows(parameters)])
        self.matrix = sp.csc_matrix(
            _stiffness(self._gradients, self._weights, triangles, len(target)) + rows.T @ rows + hold
        )

    @cached_property
    def factor(self) -> Factor:
        """The matrix's factor, made when it is first needed: edits may want that of a nearby matrix instead."""
        return factorise(self.matrix)

    @property
    def has_contacts(self) -> bool:
        """Whether contact pairs are part of the system."""
        return self._pairs is not None

    def _line_rows(self, parameters: TransferParameters) -> sp.csr_matrix:
        weight = parameters.line_weight
        if weight is None:
            weight = 100.0 if self._pairs is None else 10.0
        # Triangles grow with the square of the resolution, edges of a line with the resolution.
        self._line_scale = np.sqrt(weight * np.sqrt(len(self.triangles) / _PAPER_TRIANGLES))
        vectors = self.target[self._edges[:, 1]] - self.target[self._edges[:, 0]]
        length = np.maximum(np.sqrt(np.sum(vectors**2, axis=1)), 1e-30)
        self._line_direction = vectors / length[:, None]
        self._lines = _difference_rows(self._edges, self._line_scale / length, len(self.target))
        return self._lines

    def _contact_rows(self, parameters: TransferParameters) -> sp.csr_matrix:
        n = len(self.target)
        if self._pairs is None:
            return sp.csr_matrix((0, n))
        rim = self.target[self._pairs.edge[:, 1]] - self.target[self._pairs.edge[:, 0]]
        self._contact_scale = np.sqrt(parameters.contact_weight) / float(np.median(np.sqrt(np.sum(rim**2, axis=1))))
        rows = self._contact_scale * self._pairs.rows(n)
        self._contacts = rows[:, self._pairs.vertices]
        return rows

    def solve(self, shapes: NDArray[np.floating], goals: Array | None = None) -> Array:
        """Target shapes ``(K, V, 3)`` for source shapes ``(K, V, 3)``; ``goals`` (K, P, 3) the contact pairs' gaps."""
        right = self.right_hand_sides(shapes)
        return self.solve_for(right if goals is None else self.with_contacts(right, goals))

    def solve_for(self, right: Array) -> Array:
        """Target shapes ``(K, V, 3)`` for right-hand sides ``(V, 3, K)``."""
        moves = self.factor.solve(right.reshape(len(right), -1)).reshape(right.shape)
        moves += self.target[:, :, None]
        return moves.transpose(2, 0, 1)

    def right_hand_sides(self, shapes: NDArray[np.floating]) -> Array:
        """What the source shapes ``(K, V, 3)`` ask for, contacts aside, ``(V, 3, K)``."""
        changes = _changes(shapes, self.source)
        right = np.zeros_like(changes)
        add_pulls(self.source, self._inverse, changes, self.triangles, self._gradients, self._weights, right)
        if len(self._edges) and len(shapes):
            turned = [line_gradients(self.source, shape, self._edges, self._line_direction) for shape in shapes]
            goals = self._line_scale * _changes(np.stack(turned), self._line_direction)
            right += (self._lines.T @ goals.reshape(len(goals), -1)).reshape(right.shape)
        right[self._held] += self._hold[:, None, None] * changes[self._held]
        return right

    def with_contacts(self, right: Array, goals: Array) -> Array:
        """The right-hand sides ``(V, 3, K)`` with what the contact pairs' gaps ``(K, P, 3)`` add to them."""
        right = right.copy()
        if self._pairs is not None:
            pull = self._contact_scale * _changes(goals, self._pairs.gaps(self.target))
            forces = self._contacts.T @ pull.reshape(len(pull), -1)
            right[self._pairs.vertices] += forces.reshape(-1, *right.shape[1:])
        return right


def triangle_weights(rest: Array, shapes: NDArray[np.floating], triangles: NDArray[np.integer]) -> Array:
    """``1 / (1 + q_f^2)`` (F,), ``q_f`` the largest ``|J_f - I|`` over the shapes ``(K, V, 3)``, Frobenius norm.

    In the creases of closed lids and lips a triangle turns over or is stretched several times. Such a gradient belongs
    to the source's own crease, not to the target's; counted in full it bends its surroundings, and as positions are
    sums of gradients, the whole head. On the samples' known answers this takes a third off the error of a blink.
    """
    largest = np.empty(len(triangles))
    largest_changes(rest, _inverse_edge_frames(rest, triangles), _changes(shapes, rest), triangles, largest)
    return 1 / (1 + largest)


def largest_motion(rest: Array, shapes: NDArray[np.floating]) -> Array:
    """How far each vertex moves at most from rest in the shapes ``(K, V, 3)``, ``(V,)``.

    The bases tell it: all frames are sums of them, and what no basis moves no frame of the target moves.
    """
    squared = np.zeros(len(rest))
    for shape in shapes:
        np.maximum(squared, np.sum((shape - rest) ** 2, axis=1), out=squared)
    return np.sqrt(squared)


def _changes(shapes: NDArray[np.floating], rest: Array) -> Array:
    """``shapes - rest`` for shapes (K, n, 3), the shapes innermost, ``(n, 3, K)``."""
    changes = np.empty((*rest.shape, len(shapes)))
    np.subtract(shapes.transpose(1, 2, 0), rest[:, :, None], out=changes)
    return changes


def _inverse_edge_frames(vertices: Array, triangles: NDArray[np.integer]) -> Array:
    """Inverses ``(F, 3, 3)`` of ``[e0 e1 n]``; zero for collapsed triangles, which have neither gradient nor say."""
    inverse, squared = np.empty((len(triangles), 3, 3)), np.empty(len(triangles))
    invert_edge_frames(vertices, triangles, inverse, squared)
    inverse[squared <= _COLLAPSED**2 * (np.median(squared) if len(squared) else 0)] = 0
    return inverse


def _stiffness(gradients: Array, weights: Array, triangles: NDArray[np.integer], n_vertices: int) -> sp.csr_matrix:
    """``sum_f w_f (grad_f x)^2`` as a matrix ``(V, V)``: ``w_f g_i . g_j`` at both ends of every triangle's sides."""
    g, h = gradients[:, 0], gradients[:, 1]
    sides = [weights * np.einsum("fi,fi->f", one, other) for one, other in ((g, h), (h, -g - h), (-g - h, g))]
    ends = np.asarray(triangles)[:, [1, 2, 2, 0, 0, 1]].T.reshape(3, 2, -1)
    half = sp.coo_matrix((np.concatenate(sides), np.hstack(list(ends))), shape=(n_vertices, n_vertices)).tocsr()
    across = half + half.T
    # Constants have no gradient: every row sums to zero.
    return sp.csr_matrix(across - sp.diags(np.asarray(across.sum(axis=1)).ravel()))


def line_gradients(rest: Array, shape: Array, edges: Ids, vectors: Array) -> Array:
    """``D_l vectors_l`` (E, 3): the deformation of each feature line's edge, applied to a vector (Eq. 11).

    Eq. 11 is singular as printed. ``D_l`` is read as the smallest rotation that takes the rest edge to the deformed
    edge, times the ratio of their lengths.
    """
    before, after = rest[edges[:, 1]] - rest[edges[:, 0]], shape[edges[:, 1]] - shape[edges[:, 0]]
    length = np.maximum(np.sqrt(np.sum(before**2, axis=1, keepdims=True)), 1e-30)
    new_length = np.maximum(np.sqrt(np.sum(after**2, axis=1, keepdims=True)), 1e-30)
    u, v = before / length, after / new_length
    axis = np.cross(u, v)
    cosine = np.sum(u * v, axis=1, keepdims=True)
    # Rodrigues' formula with sin = |axis|; (1 - cos) / sin^2 = 1 / (1 + cos), which fails only at a half turn.
    turned = (
        vectors * cosine
        + np.cross(axis, vectors)
        + axis * np.sum(axis * vectors, axis=1, keepdims=True) / np.maximum(1 + cosine, 1e-6)
    )
    return np.asarray(turned * (new_length / length))


def _difference_rows(edges: Ids, scale: Array, n_vertices: int) -> sp.csr_matrix:
    rows = np.arange(len(edges))
    values = np.concatenate([scale, -scale])
    cols = np.concatenate([edges[:, 1], edges[:, 0]])
    return sp.csr_matrix((values, (np.tile(rows, 2), cols)), shape=(len(edges), n_vertices))


def _gauge(target: Array, triangles: NDArray[np.integer], motion: Array) -> tuple[Ids, Array]:
    """Vertices (H,) that say where each component is, since gradients do not; and their weights (H,).

    Vertices that the source hardly moves are held softly; a component without any is held at its quietest vertex. In
    both cases the goal is the source's own displacement, which the caller applies.
    """
    n = len(target)
    count, labels = connected_components(triangles, n)
    limit = _STILL * float(motion.max(initial=0))
    stillness = np.clip(1 - (motion / limit) ** 2, 0, None) ** 2 if limit > 0 else np.ones(n)
    still_mass = np.bincount(labels, weights=stillness, minlength=count)
    loose = still_mass < np.minimum(3, 0.02 * np.bincount(labels, minlength=count))
    by_motion = np.lexsort((motion, labels))
    quietest = by_motion[np.unique(labels[by_motion], return_index=True)[1]]
    held = np.flatnonzero(stillness > 0)
    held = np.concatenate([held[~loose[labels[held]]], quietest[loose]])
    strength = np.where(loose[labels[held]], 1.0, _HOLD_WEIGHT * stillness[held])
    corners = target[triangles]
    edge = float(np.median(np.sqrt(np.sum((corners[:, 1] - corners[:, 0]) ** 2, axis=1))))
    return held, strength / edge**2
