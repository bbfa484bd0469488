"""The one place that knows the sparse solver library (CHOLMOD, bound by cvxopt).

A factor is made once and used for many right-hand sides: that is what makes the transfer of K bases, and later
the edits, cheap. CHOLMOD factorises by supernodes, which are dense; cvxopt would substitute one column at a time, so
``L`` is taken out of it and all columns substituted together, on threads.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.blocks import map_blocks
from toolkit.substitution import substitute, without_zeros

__all__ = ["Factor", "SingularMatrixError", "factorise"]

# Right-hand sides that a thread takes together: a row of so many is two cache lines.
_COLUMNS = 16


class SingularMatrixError(ValueError):
    """The matrix leaves something undetermined; the message says how many unknowns there are."""


class Factor:
    """Sparse Cholesky factorisation of a symmetric positive definite matrix ``A`` ``(n, n)``.

    ``factor.solve(B)`` returns ``X`` with ``A X = B`` for one ``(n,)`` or many ``(n, k)`` right-hand sides.
    """

    def __init__(self, matrix: sp.spmatrix) -> None:
        if matrix.shape[0] != matrix.shape[1]:
            raise ValueError(f"a square matrix is needed, got {matrix.shape}")
        self.n = matrix.shape[0]
        try:
            self._order, parts = _cholesky(matrix)
        except ArithmeticError as error:
            raise self._singular() from error
        self._starts, self._rows, self._values = without_zeros(*parts)
        # A pivot that is zero but for rounding passes; a probe shows it.
        probe = np.linspace(-1, 1, self.n)
        residual = np.abs(matrix @ self.solve(matrix @ probe) - matrix @ probe).max(initial=0)
        if not residual <= 1e-3 * max(float(np.abs(matrix @ probe).max(initial=0)), 1e-300):
            raise self._singular()

    def solve(self, right: NDArray[np.floating]) -> NDArray[np.float64]:
        """Solve for one ``(n,)`` or many ``(n, k)`` right-hand sides."""
        dense = np.require(right, np.float64, ["C", "W"])  # one kind of array, or the loop is compiled for each
        if dense.shape[0] != self.n:
            raise ValueError(f"the right-hand side has {dense.shape[0]} rows, the matrix {self.n}")
        columns = dense.reshape(self.n, -1)
        result = np.empty(columns.shape)

        def work(first: int, last: int) -> None:
            substitute(self._starts, self._rows, self._values, self._order, first, last, columns, result)

        if columns.shape[1] <= _COLUMNS:
            work(0, columns.shape[1])
        else:
            map_blocks(work, columns.shape[1], _COLUMNS, what="substituting")
        return result.reshape(dense.shape)

    def _singular(self) -> SingularMatrixError:
        return SingularMatrixError(
            f"the {self.n} x {self.n} system is singular; some part of the mesh is held by nothing"
        )


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


def factorise(matrix: sp.spmatrix) -> Factor:
    """Factorise a symmetric positive definite matrix; see `Factor`."""
    return Factor(matrix)
