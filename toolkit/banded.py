"""Banded systems over a take's frames, for solvers that make them anew in each of their steps.

Unknowns are the weights ``(n, K)`` of n frames, and time couples a frame with the next two. Where nothing else couples
them, each weight's curve is a chain of its own, five bands wide: all K of them run side by side here, LAPACK would take
one after the other. What couples the weights of a frame makes them one system, frame by frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.linalg.lapack import dpbtrf

from toolkit.compiled import ARITHMETIC, LOOPS, njit

__all__ = ["Bands", "ChainBands", "FrameBands", "FrameRows"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ids = NDArray[np.int64]


@dataclass(frozen=True)
class FrameRows:
    """``B``: row a sees only frame ``frames[a]`` of the n, ``(B u)_a = local[a] . u[frames[a]]``, local (R, K)."""

    frames: Ids
    local: Array

    @cached_property
    def distinct(self) -> tuple[Ids, Ids]:
        """The frames, each once (F,), and which of them each row sees, (R,)."""
        frames, which = np.unique(self.frames, return_inverse=True)
        return frames, which

    @cached_property
    def _matrix(self) -> Array:
        """``B^T`` but for frames that no row sees, (F K, R)."""
        frames, which = self.distinct
        n_rows, n_bases = self.local.shape
        matrix = np.zeros((len(frames), n_bases, n_rows))
        matrix[which, :, np.arange(n_rows)] = self.local
        return matrix.reshape(-1, n_rows)

    def of(self, change: Array) -> Array:
        """``B u`` (R,)."""
        return np.asarray(change[self.distinct[0]].ravel() @ self._matrix)

    def spread(self, values: Array, like: Array) -> Array:
        """``B^T values`` (n, K)."""
        result = np.zeros(like.shape)
        result[self.distinct[0]] = (self._matrix @ values).reshape(-1, like.shape[1])
        return result


class ChainBands:
    """``Q (x) I``: K curves side by side; ``time`` = Q (n, n) of five bands."""

    def __init__(self, time: sp.csr_matrix, n_bases: int) -> None:
        self._lower = np.repeat(_diagonals(time)[:, :, None], n_bases, axis=2)

    @property
    def diagonal(self) -> Array:
        """Of the matrix, (n, K); what is added to it is added to the matrix."""
        return self._lower[0]

    def factor(self, extra: Array | None = None, stuck: Bools | None = None) -> _Chains:
        """Of the matrix and ``diag(extra)`` (n, K), the identity for all that is ``stuck`` (n, K)."""
        made = self._lower.copy()
        if extra is not None:
            made[0] += extra
        if stuck is not None:
            free = ~stuck
            for offset in range(3):
                length = max(len(free) - offset, 0)
                made[offset, :length] *= free[:length] & free[len(free) - length :]
            made[0][stuck] = 1
        return _Chains(made)


class FrameBands:
    """``sum_i Q_i (x) S_i``: the weights of a frame together; ``terms`` are pairs of Q (n, n), five bands, S (K, K)."""

    def __init__(self, terms: Sequence[tuple[sp.csr_matrix, Array]]) -> None:
        pieces = [piece for time, small in terms for piece in _pieces(time, small)]
        width = max((first + len(across) for _, first, _, across in pieces), default=1)
        self._lower = np.zeros((terms[0][0].shape[0], len(terms[0][1]), width))
        for k, first, along, across in pieces:
            self._lower[:, k, first : first + len(across)] += along[:, None] * across

    @property
    def diagonal(self) -> Array:
        """As of `ChainBands`."""
        return self._lower[:, :, 0]

    def factor(self, extra: Array | None = None, stuck: Bools | None = None) -> _Frames:
        """As of `ChainBands`; LinAlgError if the matrix is not positive definite."""
        made = self._lower.reshape(-1, self._lower.shape[2]).copy()
        if extra is not None:
            made[:, 0] += extra.ravel()
        if stuck is not None:
            free = ~stuck.ravel()
            made *= sliding_window_view(np.pad(free, (0, made.shape[1] - 1)), made.shape[1])
            made[~free] = 0
            made[~free, 0] = 1
        return _Frames(made)


Bands = ChainBands | FrameBands


def _diagonals(time: sp.csr_matrix) -> Array:
    """The diagonal and the two below it, (3, n)."""
    n = time.shape[0]
    return np.stack([np.pad(time.diagonal(-offset), (0, min(offset, n))) for offset in range(3)])


def _pieces(time: sp.csr_matrix, small: Array) -> Iterator[tuple[int, int, Array, Array]]:
    """Lower bands of ``time (x) small``: a weight, the first band, what varies over frames (n,) and over bands (m,)."""
    for step, along in enumerate(_diagonals(time)):
        for k, row in enumerate(small):
            coupled = np.flatnonzero(row)
            coupled = coupled if step else coupled[coupled >= k]
            if len(coupled) and along.any():
                yield k, step * len(small) + coupled[0] - k, along, row[coupled[0] : coupled[-1] + 1]


class _Chains:
    """K curves side by side; ``bands`` (3, n, K) become ``L D L^T``."""

    def __init__(self, bands: Array) -> None:
        _factorise_chains(bands)
        self._factor = bands

    def solve(self, right: Array) -> Array:
        """For one right-hand side (n, K)."""
        solved = right.copy()
        _substitute_chains(self._factor, solved)
        return solved

    def answers(self, rows: FrameRows) -> Array:
        """``B P^-1 B^T`` (R, R), from ``P^-1`` at pairs of the rows' frames."""
        frames, which = rows.distinct
        return np.asarray(_between_rows(rows.local, which, _between_frames(self._factor, frames)))


class _Frames:
    """All weights of a frame together; ``bands`` (n K, W) become L's columns."""

    def __init__(self, bands: Array) -> None:
        _, failed = dpbtrf(bands.T, lower=1, overwrite_ab=1)
        if failed:
            raise np.linalg.LinAlgError("the weights' matrix is not positive definite")
        self._factor = bands

    def solve(self, right: Array) -> Array:
        """For one right-hand side (n, K)."""
        n, width = self._factor.shape
        solved = np.zeros(n + width)
        solved[:n] = right.ravel()
        _substitute(self._factor, solved)
        return solved[:n].reshape(right.shape)

    def answers(self, rows: FrameRows) -> Array:
        """``B P^-1 B^T = (L^-1 B^T)^T (L^-1 B^T)``, (R, R)."""
        n_rows, n_bases = rows.local.shape
        pulls = np.zeros((len(self._factor) // n_bases, n_bases, n_rows))
        pulls[rows.frames, :, np.arange(n_rows)] = rows.local
        halves = pulls.reshape(-1, n_rows)
        _forward(self._factor, halves, int(rows.frames.min(initial=0)) * n_bases)
        return np.asarray(halves.T @ halves)


@njit(**LOOPS)
def _factorise_chains(bands):  # type: ignore[no-untyped-def]  # compiled
    """``L D L^T`` of five bands, in place: (3, n, K) becomes 1 / D and L's two diagonals."""
    _, n, count = bands.shape
    # What the rows above take off the diagonal here, off the next one, and off the band beside it.
    here, below, beside = np.zeros(count), np.zeros(count), np.zeros(count)
    for i in range(n):
        diagonal, first, second = bands[0, i], bands[1, i], bands[2, i]
        for k in range(count):
            inverse, near, far = 1 / (diagonal[k] - here[k]), first[k] - beside[k], second[k]
            diagonal[k], first[k], second[k] = inverse, near * inverse, far * inverse
            here[k] = below[k] + near * first[k]
            below[k] = far * second[k]
            beside[k] = near * second[k]


@njit(**LOOPS)
def _substitute_chains(factor, right):  # type: ignore[no-untyped-def]  # compiled
    """Solve in place for ``right`` (n, K)."""
    _forward_chains(factor, right, 0)
    n, count = right.shape
    for i in range(n - 1, -1, -1):
        inverse, first, second = factor[0, i], factor[1, i], factor[2, i]
        # Beyond the end the bands are zero.
        x, near, far = right[i], right[min(i + 1, n - 1)], right[min(i + 2, n - 1)]
        for k in range(count):
            x[k] = x[k] * inverse[k] - first[k] * near[k] - second[k] * far[k]


@njit(**LOOPS)
def _forward_chains(factor, right, start):  # type: ignore[no-untyped-def]  # compiled
    """``L^-1 right`` in place for ``right`` (n, K) that is zero before row ``start``."""
    n, count = right.shape
    for i in range(start + 1, n):
        # The one before ``start`` is zero, and so is what stands for the one before the first.
        before = max(i - 2, 0)
        x, near, far, first, second = right[i], right[i - 1], right[before], factor[1, i - 1], factor[2, before]
        for k in range(count):
            x[k] -= first[k] * near[k]
        if i > 1:
            for k in range(count):
                x[k] -= second[k] * far[k]


@njit(**LOOPS)
def _between_frames(factor, frames):  # type: ignore[no-untyped-def]  # compiled
    """``P^-1`` (F, F, K) of every curve at pairs of ``frames``, from below: ``(L^-1 e_f)^T D^-1 (L^-1 e_g)``."""
    _, n, count = factor.shape
    halves, between = np.zeros((len(frames), n, count)), np.zeros((len(frames), len(frames), count))
    for a in range(len(frames)):
        halves[a, frames[a]] = 1
        _forward_chains(factor, halves[a], frames[a])
        for b in range(a + 1):
            _add_products(halves[a], halves[b], factor[0], max(frames[a], frames[b]), between[a, b])
            between[b, a] = between[a, b]
    return between


@njit(**ARITHMETIC)
def _add_products(x, y, scale, start, total):  # type: ignore[no-untyped-def]  # compiled
    """``total[k] += sum_i x[i, k] y[i, k] scale[i, k]`` from row ``start`` on."""
    for i in range(start, len(x)):
        for k in range(len(total)):
            total[k] += x[i, k] * y[i, k] * scale[i, k]


@njit(**LOOPS)
def _between_rows(local, which, between):  # type: ignore[no-untyped-def]  # compiled
    """``sum_k local[a, k] between[which[a], which[b], k] local[b, k]``, symmetric, (R, R)."""
    n_rows, count = local.shape
    result = np.empty((n_rows, n_rows))
    for a in range(n_rows):
        for b in range(a + 1):
            total = 0.0
            for k in range(count):
                total += local[a, k] * between[which[a], which[b], k] * local[b, k]
            result[a, b] = result[b, a] = total
    return result


@njit(**LOOPS)
def _forward(factor, columns, first):  # type: ignore[no-untyped-def]  # compiled
    """``L^-1 columns`` (N, C) in place, from row ``first`` on; ``factor`` (N, W) holds L's columns, diagonal first."""
    n, width = factor.shape
    count = columns.shape[1]
    for i in range(first, n):
        for c in range(count):
            columns[i, c] /= factor[i, 0]
        for j in range(1, min(width, n - i)):
            for c in range(count):
                columns[i + j, c] -= factor[i, j] * columns[i, c]


# Sums in any order, else a dot product is one number after the other.
@njit(**ARITHMETIC | {"fastmath": {"contract", "reassoc"}})
def _substitute(factor, x):  # type: ignore[no-untyped-def]  # compiled
    """``L^-T L^-1 x`` in place; ``factor`` (N, W) as for `_forward`, and ``x`` (N + W,), are zero beyond their rows."""
    n, width = factor.shape
    for i in range(n):
        column, y = factor[i], x[i : i + width]
        value = y[0] / column[0]
        y[0] = value
        for j in range(1, width):
            y[j] -= column[j] * value
    for i in range(n - 1, -1, -1):
        column, y = factor[i], x[i : i + width]
        value = 0.0
        for j in range(1, width):
            value += column[j] * y[j]
        y[0] = (y[0] - value) / column[0]
