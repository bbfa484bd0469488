"""Lips and lids that close: contact pairs, and what their gaps should be on the target (method, section 5).

Plain transfer leaves blinks open and tears sealed lips, and feature lines close nothing. A pair is a vertex and a point
on an edge of the opposite rim; the difference of the two is the pair's gap ``c_p S``, a linear row, so that contacts
live in the factorisation of the transfer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.feature_lines import Opening

__all__ = ["TOUCHING", "ContactMap", "ContactPairs", "find_contacts"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

TOUCHING = 0.02
"""Gaps below this share of the opening's width count as touching."""

# A pair that is open at rest closes if its gap falls below this share of its own rest gap.
_CLOSING = 0.25
_STRIDE = 2


@dataclass(frozen=True)
class ContactPairs:
    """P pairs of opposite points on the rims.

    ``vertex`` (P,) and ``edge`` (P, 2) vertex ids, ``share`` (P,) the point's place on the edge, 0 at its first vertex;
    ``closes`` (P,) True where the pair is open at rest and closes in some frame; ``corners`` (P, 2) the ids of the
    corners of the pair's opening.
    """

    vertex: Ids
    edge: Ids
    share: Array
    closes: NDArray[np.bool_]
    corners: Ids

    @classmethod
    def none(cls) -> ContactPairs:
        """No pairs at all."""
        ids = np.zeros(0, dtype=np.int64)
        return cls(ids, ids.reshape(0, 2), np.zeros(0), np.zeros(0, dtype=bool), ids.reshape(0, 2))

    def __len__(self) -> int:
        return len(self.vertex)

    def rows(self, n_vertices: int) -> sp.csr_matrix:
        """``c_p``: ``rows @ x`` are the pairs' gaps, ``(P, V)``."""
        p = np.arange(len(self))
        values = np.concatenate([np.ones(len(self)), self.share - 1, -self.share])
        cols = np.concatenate([self.vertex, self.edge[:, 0], self.edge[:, 1]])
        return sp.csr_matrix((values, (np.tile(p, 3), cols)), shape=(len(self), n_vertices))

    def gaps(self, vertices: NDArray[np.floating]) -> Array:
        """Gap vectors ``(..., P, 3)`` of positions ``(..., V, 3)``."""
        on_edge = (1 - self.share)[:, None] * vertices[..., self.edge[:, 0], :]
        on_edge = on_edge + self.share[:, None] * vertices[..., self.edge[:, 1], :]
        return np.asarray(vertices[..., self.vertex, :] - on_edge, dtype=np.float64)

    def widths(self, vertices: NDArray[np.floating]) -> Array:
        """Corner-to-corner width of each pair's opening, ``(P,)``."""
        apart = vertices[self.corners[:, 0]] - vertices[self.corners[:, 1]]
        return np.sqrt(np.sum(apart**2, axis=1))

    @property
    def vertices(self) -> Ids:
        """All vertices that take part, sorted."""
        return np.unique(np.concatenate([self.vertex, self.edge.ravel()]))


def find_contacts(openings: Sequence[Opening], reference: Array, frames: NDArray[np.floating]) -> ContactPairs:
    """Pairs across every opening: for every second vertex of one rim, the nearest point of the other.

    Nearest in the frame where the two are nearest, so that lids pair as they will meet. ``reference`` (V, 3);
    ``frames`` (T, V, 3) a choice of stabilised frames, the closed ones among them.
    """
    everything = np.concatenate([reference[None], frames]) if len(frames) else reference[None]
    parts = []
    for opening in openings:
        for side, other in ((opening.upper, opening.lower), (opening.lower, opening.upper)):
            corners = np.array([opening.upper[0], opening.upper[-1]])
            inner = side[~np.isin(side, other)][::_STRIDE]
            if len(inner):
                parts.append(_nearest_across(everything, inner, other, corners))
    if not parts:
        return ContactPairs.none()
    joined = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return _with_closing(
        ContactPairs(joined[0], joined[1], joined[2], np.zeros(len(joined[0]), bool), joined[3]), everything
    )


def _nearest_across(frames: NDArray[np.floating], side: Ids, other: Ids, corners: Ids) -> tuple[Ids, Ids, Array, Ids]:
    # About their middle, so that squares of positions do not swallow those of distances.
    middle = frames[0, side].mean(axis=0)
    points = (frames[:, side] - middle).astype(np.float64)
    starts, ends = ((frames[:, ids] - middle).astype(np.float64) for ids in (other[:-1], other[1:]))
    direction = ends - starts
    squared = np.maximum(_dots(direction, direction), 1e-30).transpose(0, 2, 1)
    # |p - s - a d|^2 from products of matrices, (T, n, m): nothing with a fourth axis is made.
    one = np.ones_like(points[:, :, :1])
    along = _products([points, one], [direction, -_dots(starts, direction)])
    distance = _products(
        [points, _dots(points, points), one], [-2 * starts, np.ones_like(starts[:, :, :1]), _dots(starts, starts)]
    )
    share = along / squared
    np.clip(share, 0, 1, out=share)
    along *= 2
    along -= share * squared
    along *= share
    distance -= along
    segments = np.argmin(distance, axis=2)
    at = np.arange(len(side))
    frame = np.argmin(np.take_along_axis(distance, segments[:, :, None], axis=2)[:, :, 0], axis=0)
    segment = segments[frame, at]
    edge = np.stack([other[segment], other[segment + 1]], axis=1)
    return side, edge, share[frame, at, segment], np.tile(corners, (len(side), 1))


def _dots(a: Array, b: Array) -> Array:
    """Dot products (T, n, 1) of vectors (T, n, 3)."""
    return np.sum(a * b, axis=2, keepdims=True)


def _products(left: list[Array], right: list[Array]) -> Array:
    """``L R^T`` (T, n, m) of the columns of both, each joined."""
    return np.asarray(np.concatenate(left, axis=2) @ np.concatenate(right, axis=2).transpose(0, 2, 1))


def _with_closing(pairs: ContactPairs, frames: NDArray[np.floating]) -> ContactPairs:
    gaps = np.linalg.norm(pairs.gaps(frames), axis=2)
    rest, least = gaps[0], gaps.min(axis=0)
    closes = (rest > TOUCHING * pairs.widths(frames[0])) & (least < _CLOSING * rest)
    return ContactPairs(pairs.vertex, pairs.edge, pairs.share, closes, pairs.corners)


class ContactMap:
    """The target's gaps that belong to the source's: ``g_p(s) = t0 + M_p (s - s0)``, linear in ``s``.

    ``M_p = k I + eta_p (t0 - k s0) s0^T / (|s0|^2 + eps^2)``: with ``eta = 1`` (pairs that are open at rest and close)
    the source's share of its rest opening becomes the target's, so zero goes to zero; with ``eta = 0`` the rest gap
    stays and the motion is scaled by the openings' width ratio ``k``. Rest gaps ``s0``, ``t0`` are (P, 3).
    """

    def __init__(self, pairs: ContactPairs, source: Array, target: Array) -> None:
        self.source_rest = pairs.gaps(source)
        self.target_rest = pairs.gaps(target)
        source_width, target_width = pairs.widths(source), pairs.widths(target)
        ratio = (target_width / np.maximum(source_width, 1e-30))[:, None, None]
        eps = TOUCHING * source_width
        squared = np.sum(self.source_rest**2, axis=1) + eps**2
        open_on_target = np.linalg.norm(self.target_rest, axis=1) > TOUCHING * target_width
        eta = (pairs.closes & open_on_target)[:, None, None]
        bend = self.target_rest[:, :, None] - ratio * self.source_rest[:, :, None]
        self.matrix = (
            ratio * np.eye(3) + eta * bend * (self.source_rest / np.maximum(squared, 1e-300)[:, None])[:, None, :]
        )

    def __call__(self, source_gaps: Array) -> Array:
        """Gaps ``(..., P, 3)`` of the source -> gaps of the target."""
        return np.asarray(self.target_rest + self.change(source_gaps - self.source_rest))

    def change(self, source_change: Array) -> Array:
        """Change of the gaps ``(..., P, 3)`` from rest on the source -> on the target."""
        return np.asarray(np.einsum("pij,...pj->...pi", self.matrix, source_change))
