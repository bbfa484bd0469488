"""Lids and lips that touch, and what opening them costs an edit's weights.

The bases' side of an edit keeps together what touches, since contacts are part of the transfer's matrix. The weights
know nothing of them: a little more of one expression and a little less of another, and a closed eye stands open. So in
the frames in which a pair of opposite points touches, a change ``u`` of the weights costs

    sum_t sum_p s_tp sum_k |c_p m_k|^2 u_tk^2 / P,

``s_tp`` how far pair p touches in frame t, ``c_p m_k`` how far basis k moves it apart, P the pairs of its opening: a
weight is held by what its basis alone opens. ``|sum_k u_tk c_p m_k|^2`` would let weights move whose openings cancel,
but it couples all weights of a frame: that takes four times as long, and on a sample face it neither met the
constraints better nor held lids and lips better.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from toolkit.contacts import TOUCHING, ContactPairs

__all__ = ["TouchingPairs"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class TouchingPairs:
    """Which contact ``pairs`` touch when: ``touching`` (T, P), 1 where they do, 0 where they do not."""

    pairs: ContactPairs
    touching: Array

    @classmethod
    def by_gaps(cls, pairs: ContactPairs, gaps: NDArray[np.floating], rest: Array) -> TouchingPairs:
        """From the source's gaps (T, P, 3) and rest shape (V, 3); fading between one width of a touch and two."""
        share = np.sqrt(np.sum(gaps**2, axis=2)) / np.maximum(pairs.widths(rest), 1e-300)
        return cls(pairs, np.clip(2 - share / TOUCHING, 0, 1))

    def let_go(self, vertices: Ids) -> TouchingPairs:
        """Without the openings whose rims the ``vertices`` lie on: who pulls at a lid may open the eye."""
        pairs, inner = self.pairs, np.setdiff1d(vertices, self.pairs.corners)
        pulled = np.isin(pairs.vertex, inner) | np.isin(pairs.edge, inner).any(axis=1)
        if not pulled.any():
            return self
        opening = self._openings[0]
        return TouchingPairs(pairs, np.where(np.isin(opening, opening[pulled]), 0.0, self.touching))

    def opened_by(self, moves: Array) -> Array:
        """What each basis opens, (P, K), in squared mesh units: ``touching @`` it is what each weight costs, (T, K).

        ``moves`` (K, n, 3) are the bases' displacements at ``pairs.vertices``.
        """
        ids = self.pairs.vertices
        gap = self.pairs.rows(int(ids.max(initial=-1)) + 1)[:, ids]
        squared = np.stack([np.sum((gap @ move) ** 2, axis=1) for move in moves], axis=1)
        opening, count = self._openings
        return np.asarray(squared / count[opening][:, None])

    @cached_property
    def _openings(self) -> tuple[Ids, Ids]:
        """Which opening each pair belongs to (P,), and how many pairs each opening has."""
        _, opening, count = np.unique(self.pairs.corners, axis=0, return_inverse=True, return_counts=True)
        return opening.ravel(), count
