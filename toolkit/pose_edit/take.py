"""What is edited: the transferred bases and weights of a take, with the factor that the transfer made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.pose_edit.contacts import TouchingPairs
from toolkit.solve import Factor

__all__ = ["DetailOffset", "EditableTake", "LowRankMoves", "ShapeAt", "TransferSystem"]

Array = NDArray[np.float64]

ShapeAt = Callable[[NDArray[np.int64]], Array]
"""``shape_at(vertices)``: places on the smoothed surface of one frame, (n, 3)."""

DetailOffset = Callable[[int, NDArray[np.int64], ShapeAt], Array]
"""``detail_offset(frame, vertices, shape_at)``: what details add to the smoothed surface there, (n, 3)."""


class TransferSystem(Protocol):
    """The part of `toolkit.transfer.DeformationTransfer` that edits need: ``A`` and its factor."""

    @property
    def matrix(self) -> sp.csc_matrix:
        """``A``, (V, V)."""

    @property
    def factor(self) -> Factor:
        """Of the matrix."""


@dataclass(frozen=True)
class LowRankMoves:
    """A change of all K bases: basis k moves by ``responses (V, U) @ coefficients (U, K, 3)[:, k]``."""

    responses: Array
    coefficients: Array

    def of_bases(self) -> Array:
        """The change of every basis, ``(K, V, 3)``; large, so for export and tests only."""
        n_responses, n_bases, _ = self.coefficients.shape
        moved = self.responses @ self.coefficients.reshape(n_responses, -1)
        return np.ascontiguousarray(moved.reshape(-1, n_bases, 3).transpose(1, 0, 2))

    def at(self, vertices: NDArray[np.integer]) -> Array:
        """The change of every basis at some vertices, ``(K, n, 3)``."""
        return np.asarray(np.einsum("nu,ukc->knc", self.responses[vertices], self.coefficients))

    def of_frame(self, weights: Array) -> Array:
        """What it does to a frame with weights (K,), ``(V, 3)``."""
        return np.asarray(self.responses @ np.einsum("k,ukc->uc", weights, self.coefficients))


@dataclass(frozen=True, eq=False)
class EditableTake:
    """A take in delta form: ``T~_t = rest + sum_k weights[t, k] moves[k]``.

    Parameters
    ----------
    rest : (V, 3) smoothed target at rest, ``T~_0``
    moves : (K, V, 3) ``b'_k - T~_0``
    weights : (T, K), non-negative
    system : the transfer's normal matrix and factor
    detail_offset : what the user sees is the smoothed surface plus this (`VisibleDetails`); nothing by default
    edits : earlier edits of the bases, kept as low-rank additions to ``moves``
    contacts : which lids and lips touch when, if that is known
    """

    rest: Array
    moves: Array
    weights: Array
    system: TransferSystem
    detail_offset: DetailOffset | None = None
    edits: tuple[LowRankMoves, ...] = ()
    contacts: TouchingPairs | None = None

    @property
    def n_vertices(self) -> int:
        """Number of vertices V."""
        return len(self.rest)

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self.weights)

    @property
    def n_bases(self) -> int:
        """Number of bases K."""
        return len(self.moves)

    def moves_at(self, vertices: Sequence[int] | NDArray[np.integer]) -> Array:
        """The bases' displacements at some vertices, earlier edits included, ``(K, n, 3)``."""
        ids = np.asarray(vertices, dtype=np.int64)
        moved = np.array(self.moves[:, ids], dtype=np.float64)
        for edit in self.edits:
            moved += edit.at(ids)
        return moved

    def displacements_at(self, frame: int, vertices: Sequence[int] | NDArray[np.integer]) -> Array:
        """How far some vertices of the smoothed surface are from rest in a frame, ``(n, 3)``."""
        return np.asarray(np.einsum("k,knc->nc", self.weights[frame], self.moves_at(vertices)))

    def detail_at(self, frame: int, vertices: Sequence[int] | NDArray[np.integer]) -> Array:
        """What details add at some vertices of a frame, ``(n, 3)``."""
        ids = np.asarray(vertices, dtype=np.int64)
        if self.detail_offset is None:
            return np.zeros((len(ids), 3))
        return self.detail_offset(frame, ids, lambda near: self.rest[near] + self.displacements_at(frame, near))

    def smooth_frame(self, frame: int) -> Array:
        """The smoothed surface of one frame, ``(V, 3)``."""
        weights = self.weights[frame]
        shape = np.tensordot(weights.astype(self.moves.dtype), self.moves, 1) + self.rest
        for edit in self.edits:
            shape = shape + edit.of_frame(weights)
        return np.asarray(shape)

    def edited(self, weights: Array, moves: LowRankMoves | None) -> EditableTake:
        """The take with other weights and a further change of the bases."""
        return replace(self, weights=weights, edits=self.edits if moves is None else (*self.edits, moves))
