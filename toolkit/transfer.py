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
from toolkit.kernels import edge_frames, keep_largest_change
from toolkit.mesh.topology import connected_components
from toolkit.operators import gradient
from toolkit.progress import Progress, silent
from toolkit.solve import Factor, factorise

__all__ = [
    "DeformationTransfer",
    "TransferParameters",
    "deformation_gradients",
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
        root = np.sqrt(weights) if weights is not None else np.ones(len(triangles))
        self._gradient = sp.csr_matrix(sp.diags(np.repeat(root, 3)) @ gradient(target, triangles))
        # G^T J^T = (G^T E^-T) E'^T: one sparse product a shape, and no gradient is ever formed.
        inverse, _ = _inverse_edge_frames(source, triangles)
        wanted = root[:, None, None] * inverse.transpose(0, 2, 1)
        self._pull = sp.csr_matrix(self._gradient.T @ _block_diagonal(wanted))
        self._pull_at_rest = self._pull @ _edge_frames(source, triangles).transpose(0, 2, 1).reshape(-1, 3)
        self._edges = edges if edges is not None and parameters.feature_lines else np.zeros((0, 2), dtype=np.int64)
        self._pairs = pairs if pairs is not None and parameters.contacts and len(pairs) else None
        blocks = [self._gradient]
        blocks.append(self._line_rows(parameters))
        blocks.append(self._contact_rows(parameters))
        self._gauge, self._gauge_weight = _gauge_rows(target, triangles, motion)
        blocks.append(sp.diags(self._gauge_weight) @ self._gauge)
        self.matrix = sp.csc_matrix(
            sum((rows.T @ rows for rows in blocks if rows.shape[0]), start=sp.csc_matrix((len(target), len(target))))
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
        scaled = weight * np.sqrt(len(self.triangles) / _PAPER_TRIANGLES)
        vectors = self.target[self._edges[:, 1]] - self.target[self._edges[:, 0]]
        self._line_length = np.maximum(np.sqrt(np.sum(vectors**2, axis=1)), 1e-30)
        self._line_direction = vectors / self._line_length[:, None]
        self._line_scale = np.full(len(self._edges), np.sqrt(scaled))
        self._lines = _difference_rows(self._edges, self._line_scale / self._line_length, len(self.target))
        return self._lines

    def _contact_rows(self, parameters: TransferParameters) -> sp.csr_matrix:
        n = len(self.target)
        if self._pairs is None:
            self._contacts = sp.csr_matrix((0, n))
            self._contact_scale = 0.0
            return self._contacts
        rim = self.target[self._pairs.edge[:, 1]] - self.target[self._pairs.edge[:, 0]]
        self._contact_scale = np.sqrt(parameters.contact_weight) / float(np.median(np.sqrt(np.sum(rim**2, axis=1))))
        self._contacts = self._contact_scale * self._pairs.rows(n)
        return self._contacts

    def solve(self, shapes: NDArray[np.floating], goals: Array | None = None) -> Array:
        """Target shapes ``(K, V, 3)`` for source shapes ``(K, V, 3)``; ``goals`` (K, P, 3) the contact pairs' gaps."""
        right = self.right_hand_sides(shapes)
        if goals is not None:
            right += self.contact_forces(goals)
        return self.solve_for(right)

    def solve_for(self, right: Array) -> Array:
        """Target shapes ``(K, V, 3)`` for right-hand sides ``(K, V, 3)``."""
        columns = right.transpose(1, 0, 2).reshape(len(self.target), -1)
        return self.target + self.factor.solve(columns).reshape(len(self.target), -1, 3).transpose(1, 0, 2)

    def right_hand_sides(self, shapes: NDArray[np.floating], progress: Progress = silent) -> Array:
        """What the source shapes ``(K, V, 3)`` ask for, contacts aside, ``(K, V, 3)``."""
        right = np.empty((len(shapes), len(self.target), 3))
        for k, shape in enumerate(shapes):
            right[k] = self._right_hand_side(np.asarray(shape, dtype=np.float64))
            progress("transferring bases", k + 1, len(shapes))
        return right

    def contact_forces(self, goals: Array) -> Array:
        """What the contact pairs' gaps ``(K, P, 3)`` add to the right-hand sides, ``(K, V, 3)``."""
        if self._pairs is None:
            return np.zeros((len(goals), len(self.target), 3))
        pull = self._contact_scale * (goals - self._pairs.gaps(self.target))
        return np.stack([np.asarray(self._contacts.T @ one) for one in pull])

    def _right_hand_side(self, shape: Array) -> Array:
        spanned = _edge_frames(shape, self.triangles).transpose(0, 2, 1).reshape(-1, 3)
        right = self._pull @ spanned - self._pull_at_rest
        if len(self._edges):
            turned = line_gradients(self.source, shape, self._edges, self._line_direction) - self._line_direction
            right += self._lines.T @ (self._line_scale[:, None] * turned)
        right += self._gauge.T @ (self._gauge_weight[:, None] ** 2 * (self._gauge @ (shape - self.source)))
        return np.asarray(right)


def deformation_gradients(rest: Array, shape: Array, triangles: NDArray[np.integer]) -> Array:
    """``J_f`` (F, 3, 3) with ``J_f [e0 e1 n] = [e0' e1' n']``, ``n = e0 x e1 / sqrt(|e0 x e1|)`` (Eq. 10, Sumner)."""
    inverse, flat = _inverse_edge_frames(rest, triangles)
    gradients = np.asarray(_edge_frames(shape, triangles) @ inverse)
    gradients[flat] = np.eye(3)
    return gradients


def triangle_weights(rest: Array, shapes: NDArray[np.floating], triangles: NDArray[np.integer]) -> Array:
    """``1 / (1 + q_f^2)`` (F,), ``q_f`` the largest ``|J_f - I|`` over the shapes ``(K, V, 3)``, Frobenius norm.

    In the creases of closed lids and lips a triangle turns over or is stretched several times. Such a gradient belongs
    to the source's own crease, not to the target's; counted in full it bends its surroundings, and as positions are
    sums of gradients, the whole head. On the samples' known answers this takes a third off the error of a blink.
    """
    inverse, flat = _inverse_edge_frames(rest, triangles)
    largest = np.zeros(len(triangles))
    for shape in shapes:
        keep_largest_change(np.asarray(shape, dtype=np.float64), triangles, inverse, largest)
    return 1 / (1 + np.where(flat, 0, largest))


def _inverse_edge_frames(vertices: Array, triangles: NDArray[np.integer]) -> tuple[Array, NDArray[np.bool_]]:
    """Inverses ``(F, 3, 3)``, zero for collapsed triangles, which say nothing about the deformation; and which are."""
    frames = _edge_frames(vertices, triangles)
    e0, e1, n = (frames[:, :, k] for k in range(3))
    rows = np.stack([np.cross(e1, n), np.cross(n, e0), np.cross(e0, e1)], axis=1)
    determinant = np.sum(e0 * rows[:, 0], axis=1)
    flat = np.abs(determinant) <= 1e-12 * np.maximum(np.abs(frames).max(axis=(1, 2)) ** 3, 1e-300)
    scale = np.where(flat, 0, 1 / np.where(flat, 1, determinant))
    return rows * scale[:, None, None], flat


def _block_diagonal(blocks: Array) -> sp.bsr_matrix:
    n = len(blocks)
    return sp.bsr_matrix((blocks, np.arange(n), np.arange(n + 1)), shape=(3 * n, 3 * n))


def _edge_frames(vertices: Array, triangles: NDArray[np.integer]) -> Array:
    frames = np.empty((len(triangles), 3, 3))
    edge_frames(vertices, triangles, frames)
    return frames


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


def _gauge_rows(target: Array, triangles: NDArray[np.integer], motion: Array) -> tuple[sp.csr_matrix, Array]:
    """Rows that say where each component is, since gradients do not; and their weights.

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
    rows = sp.csr_matrix((np.ones(len(held)), (np.arange(len(held)), held)), shape=(len(held), n))
    return rows, np.sqrt(strength) / edge
