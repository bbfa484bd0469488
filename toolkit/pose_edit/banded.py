"""Banded systems of the weights step, made anew in each of its steps.

Unknowns are the weights ``(n, K)`` of n frames. Without fixed vertices each weight's curve is a chain of its own, five
bands wide: all K of them run side by side here, LAPACK would take one after the other. Fixed vertices couple the
weights of a frame, and time couples a frame with the next two: one system of 4 K + 1 bands, frame by frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded
from scipy.linalg.lapack import dgetrf, dgetrs

from toolkit.compiled import ARITHMETIC, LOOPS, njit

__all__ = ["FrameRows", "SmallFactor", "System", "chain_bands", "frame_bands"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True)
class FrameRows:
    """``B``: row a sees only frame ``frames[a]`` of the window, ``(B u)_a = local[a] . u[frames[a]]``, local (R, K)."""

    frames: Ids
    local: Array

    @cached_property
    def distinct(self) -> tuple[Ids, Ids]:
        """The frames, each once (F,), and which of them each row sees, (R,)."""
        frames, which = np.unique(self.frames, return_inverse=True)
        return frames, which

    @cached_property
    def _together(self) -> Array:
        """Adds up the rows of each frame, (F, R)."""
        frames, which = self.distinct
        return np.equal.outer(np.arange(len(frames)), which).astype(np.float64)

    def of(self, change: Array) -> Array:
        """``B u`` (R,)."""
        return np.asarray(np.einsum("ak,ak->a", self.local, change[self.frames]))

    def spread(self, values: Array, like: Array) -> Array:
        """``B^T values`` (n, K)."""
        result = np.zeros_like(like)
        result[self.distinct[0]] = self._together @ (values[:, None] * self.local)
        return result


def chain_bands(time: sp.csr_matrix, n_bases: int) -> Array:
    """Lower bands (3, n, K) of ``Q`` for every weight's curve."""
    n = time.shape[0]
    bands = np.stack([np.pad(time.diagonal(offset), (0, min(offset, n))) for offset in range(3)])
    return np.repeat(bands[:, :, None], n_bases, axis=2)


def frame_bands(time: sp.csr_matrix, gram: Array) -> Array:
    """Lower bands (2 K + 1, n K) of ``Q (x) I + I (x) G``."""
    (n, _), n_bases = time.shape, len(gram)
    bands = np.zeros((2 * n_bases + 1, n * n_bases))
    for offset in range(n_bases):
        bands[offset] = np.tile(np.pad(np.diagonal(gram, offset), (0, offset)), n)
    for step in range(3):
        bands[step * n_bases] += np.repeat(np.pad(time.diagonal(step), (0, min(step, n))), n_bases)
    return bands


class SmallFactor:
    """LU factors of a small matrix (R, R), by LAPACK itself: SciPy's own call takes longer than the work."""

    def __init__(self, matrix: Array) -> None:
        self._factors, self._pivots, failed = dgetrf(matrix)
        if failed:
            raise np.linalg.LinAlgError("the constraints' matrix is singular")

    def solve(self, right: Array) -> Array:
        """Solve for (R,)."""
        return np.asarray(dgetrs(self._factors, self._pivots, right)[0])


class System:
    """``P + diag(extra) + B^T M^-1 B``: the banded part ``P`` factorised, the few rows by Woodbury's formula.

    Parameters
    ----------
    bands : of ``P``, from `chain_bands` or `frame_bands`
    rows, metric : ``B`` and ``M`` (R, R)
    extra : (n, K), not negative, or None
    stuck : (n, K), the weights that cannot move, or None
    """

    def __init__(
        self,
        bands: Array,
        rows: FrameRows,
        metric: Array,
        extra: Array | None = None,
        stuck: NDArray[np.bool_] | None = None,
    ) -> None:
        self._stuck, self._rows = stuck, rows
        made = bands.copy()
        if extra is not None:
            made[0] += extra.reshape(made[0].shape)
        if stuck is not None:
            self._rows = FrameRows(rows.frames, np.where(stuck[rows.frames], 0.0, rows.local))
            _strike(made, ~stuck.reshape(made[0].shape))
        self._factor = _Chains(made) if made.ndim == 3 else _Frames(made)
        self._small = SmallFactor(metric + self._factor.answers(self._rows))

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side (n, K); what cannot move stays zero."""
        alone = self._factor.solve(right if self._stuck is None else np.where(self._stuck, 0.0, right))
        pull = self._small.solve(self._rows.of(alone))
        return np.asarray(alone - self._factor.solve(self._rows.spread(pull, alone)))


def _strike(bands: Array, free: NDArray[np.bool_]) -> None:
    """Make rows and columns of the identity for all that is not free, in place."""
    for offset in range(len(bands)):
        length = max(len(free) - offset, 0)
        bands[offset, :length] *= free[:length] & free[len(free) - length :]
    bands[0, ~free] = 1


class _Chains:
    """K curves side by side; ``bands`` (3, n, K) become ``L D L^T``."""

    def __init__(self, bands: Array) -> None:
        _factorise_chains(bands)
        self._factor = bands

    def solve(self, right: Array) -> Array:
        solved = right.copy()
        _substitute_chains(self._factor, solved)
        return solved

    def answers(self, rows: FrameRows) -> Array:
        """``B P^-1 B^T`` (R, R), from ``P^-1`` at pairs of the rows' frames."""
        frames, which = rows.distinct
        return np.asarray(_between_rows(rows.local, which, _between_frames(self._factor, frames)))


class _Frames:
    """All weights of a frame together; ``bands`` (2 K + 1, n K)."""

    def __init__(self, bands: Array) -> None:
        factor = cholesky_banded(bands, overwrite_ab=True, lower=True, check_finite=False)
        self._factor = np.ascontiguousarray(factor.T)

    def solve(self, right: Array) -> Array:
        solved = right.reshape(-1, 1).copy()
        _forward(self._factor, solved, 0)
        _backward(self._factor, solved)
        return solved.reshape(right.shape)

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


@njit(**LOOPS)
def _backward(factor, columns):  # type: ignore[no-untyped-def]  # compiled
    """``L^-T columns`` (N, C) in place."""
    n, width = factor.shape
    count = columns.shape[1]
    for i in range(n - 1, -1, -1):
        for j in range(1, min(width, n - i)):
            for c in range(count):
                columns[i, c] -= factor[i, j] * columns[i + j, c]
        for c in range(count):
            columns[i, c] /= factor[i, 0]
