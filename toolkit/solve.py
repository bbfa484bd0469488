"""The one place that knows the sparse solver library (CHOLMOD, bound by cvxopt).

A factor is made once and used for many right-hand sides: that is what makes the transfer of K bases, and later
the edits, cheap. CHOLMOD factorises by supernodes, which are dense; cvxopt would substitute one column at a time, so
``L`` is taken out of it and all columns substituted together, on threads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.blocks import map_blocks
from toolkit.substitution import Lower, part_of, substitute_backward, substitute_forward, with_ancestors, without_zeros

__all__ = ["Factor", "PulledSolve", "SingularMatrixError", "factorise"]

Array = NDArray[np.float64]

# Right-hand sides that a thread takes together: a row of so many is two cache lines.
_COLUMNS = 16
# A pivot that is less than this share of the unknown's own entry in the matrix is zero but for rounding.
_NO_PIVOT = 1e-12


class SingularMatrixError(ValueError):
    """The matrix leaves something undetermined; the message says how many unknowns there are."""


@dataclass(frozen=True, eq=False)
class Factor:
    """Sparse Cholesky factorisation ``A[order][:, order] = L L^T`` of a matrix ``(n, n)``, made by `factorise`.

    ``lower`` is ``L`` as `toolkit.substitution` takes it.
    """

    order: NDArray[np.uint32]
    lower: Lower

    @property
    def n(self) -> int:
        """The number of unknowns."""
        return len(self.order)

    def solve(self, right: NDArray[np.floating]) -> Array:
        """``X`` with ``A X = B`` for one ``(n,)`` or many ``(n, k)`` right-hand sides."""
        dense = np.require(right, np.float64, ["C", "W"])  # one kind of array, or the loop is compiled for each
        if dense.shape[0] != self.n:
            raise ValueError(f"the right-hand side has {dense.shape[0]} rows, the matrix {self.n}")
        columns = dense.reshape(self.n, -1)
        result = np.empty(columns.shape)

        def work(first: int, last: int) -> None:
            self.backward(self.forward(columns, first, last), first, last, result)

        _by_columns(work, columns.shape[1])
        return result.reshape(dense.shape)

    def forward(self, right: Array, first: int, last: int) -> Array:
        """The first half of a solve, for columns ``first <= c < last`` of ``right`` (n, k): ``L^-1 right[order]``."""
        return np.asarray(substitute_forward(self.lower, self.order, first, last, right))

    def backward(self, half: Array, first: int, last: int, out: Array) -> None:
        """The second half: ``L^-T half`` into these columns of ``out`` (n, k); ``half`` is spent."""
        substitute_backward(self.lower, self.order, half, first, last, out)


class PulledSolve:
    """``A X = B`` where what ``B`` is at a few unknowns depends on what ``X`` is there.

    Forward substitution carries a pull at an unknown to its ancestors in the elimination tree only, and in backward
    substitution it depends on these only. Their part of ``L`` is therefore a factor itself, that of the matrix from
    which all others are eliminated, and ``B`` is substituted forward once. Exact, at a third of a substitution's cost
    for the rims of a face's eyes and mouth.

    Parameters
    ----------
    factor : of ``A`` (n, n)
    right : (n, k)
    unknowns : (u,) those that are pulled or asked for
    """

    def __init__(self, factor: Factor, right: Array, unknowns: NDArray[np.integer]) -> None:
        self._factor, self._n_columns = factor, right.shape[1]
        position = np.empty(factor.n, dtype=np.int64)
        position[factor.order] = np.arange(factor.n)
        reached = np.zeros(factor.n, dtype=bool)
        reached[position[unknowns]] = True
        with_ancestors(factor.lower, reached)
        self._reached = np.flatnonzero(reached)
        self._at = np.searchsorted(self._reached, position[unknowns])
        order = np.arange(len(self._reached), dtype=np.uint32)
        self._part = Factor(order, part_of(factor.lower, self._reached))
        self._halves: dict[int, Array] = {}

        def work(first: int, last: int) -> None:
            self._halves[first] = factor.forward(right, first, last)

        _by_columns(work, self._n_columns)

    def at_unknowns(self, pulls: Array) -> Array:
        """What ``X`` is at the unknowns if ``pulls`` (u, k) are added to ``B`` there, ``(u, k)``."""
        placed = self._placed(pulls)
        result = np.empty(placed.shape)

        def work(first: int, last: int) -> None:
            half = self._part.forward(placed, first, last)
            half += self._halves[first][self._reached]
            self._part.backward(half, first, last, result)

        _by_columns(work, self._n_columns)
        return np.asarray(result[self._at])

    def everywhere(self, pulls: Array) -> Array:
        """``X`` (n, k) if ``pulls`` (u, k) are added to ``B``; the last thing to ask for, since it takes the memory."""
        placed = self._placed(pulls)
        result = np.empty((self._factor.n, self._n_columns))

        def work(first: int, last: int) -> None:
            half = self._halves.pop(first)
            half[self._reached] += self._part.forward(placed, first, last)
            self._factor.backward(half, first, last, result)

        _by_columns(work, self._n_columns)
        return result

    def _placed(self, pulls: Array) -> Array:
        placed = np.zeros((self._part.n, self._n_columns))
        placed[self._at] = pulls
        return placed


def factorise(matrix: sp.spmatrix) -> Factor:
    """Factorise a symmetric positive definite matrix ``(n, n)``; `SingularMatrixError` where it is not."""
    n = matrix.shape[0]
    if matrix.shape[1] != n:
        raise ValueError(f"a square matrix is needed, got {matrix.shape}")
    singular = SingularMatrixError(f"the {n} x {n} system is singular; some part of the mesh is held by nothing")
    try:
        order, parts = _cholesky(matrix)
    except ArithmeticError as error:
        raise singular from error
    starts, rows, values = without_zeros(*parts)
    # A pivot that is zero but for rounding passes.
    pivots = values[starts[:-1]] ** 2
    if not (pivots > _NO_PIVOT * matrix.diagonal()[order]).all():
        raise singular
    return Factor(order, (starts, rows, values))


def _cholesky(matrix: sp.spmatrix) -> tuple[NDArray[np.uint32], Iterator[NDArray]]:
    """The order (n,) of the unknowns and the starts, rows and values of ``L``, for `toolkit.substitution`."""
    from cvxopt import cholmod, spmatrix
    from cvxopt import matrix as dense

    csc = sp.csc_matrix(matrix)
    n = csc.shape[0]
    columns = np.repeat(np.arange(n), np.diff(csc.indptr))
    lower = csc.indices >= columns  # CHOLMOD reads no more
    parts = csc.data[lower].astype(np.float64), csc.indices[lower].astype(np.int64), columns[lower]
    half = spmatrix(*(dense(part) if len(part) else [] for part in parts), csc.shape)
    factor = cholmod.symbolic(half)
    cholmod.numeric(half, factor)
    # Asked for the permuted right-hand side, since the permutation itself has no other way out.
    order = dense(np.arange(n, dtype=np.float64))
    cholmod.solve(factor, order, sys=7)
    found = (np.asarray(memoryview(part)).ravel() for part in cholmod.getfactor(factor).CCS)
    return np.array(order).ravel().astype(np.uint32), found


def _by_columns(work: Callable[[int, int], None], n_columns: int) -> None:
    """Call ``work(first, last)`` for blocks of columns, on threads where there are several."""
    if n_columns <= _COLUMNS:
        work(0, n_columns)
    else:
        map_blocks(work, n_columns, _COLUMNS, what="substituting")
