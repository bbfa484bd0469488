"""The one place that knows the sparse solver library.

A factor is made once and used for many right-hand sides: that is what makes the transfer of K bases, and later
the edits, cheap.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

__all__ = ["Factor", "SingularMatrixError", "factorise"]


class SingularMatrixError(ValueError):
    """The matrix leaves something undetermined; the message says how many unknowns and what to add."""


class Factor:
    """Sparse factorisation of a symmetric positive definite matrix ``A`` ``(n, n)``.

    ``factor.solve(B)`` returns ``X`` with ``A X = B`` for one ``(n,)`` or many ``(n, k)`` right-hand sides.
    """

    def __init__(self, matrix: sp.spmatrix) -> None:
        csc = sp.csc_matrix(matrix)
        if csc.shape[0] != csc.shape[1]:
            raise ValueError(f"a square matrix is needed, got {csc.shape}")
        self.n = csc.shape[0]
        try:
            # Minimum degree on A + A^T without pivoting: SuperLU's nearest thing to a Cholesky factorisation, and
            # five times quicker than its default on these meshes.
            self._lu = splu(csc, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError as error:
            raise SingularMatrixError(
                f"the {self.n} x {self.n} system is singular; some part of the mesh is held by nothing"
            ) from error

    def solve(self, right: NDArray[np.floating]) -> NDArray[np.float64]:
        """Solve for one ``(n,)`` or many ``(n, k)`` right-hand sides."""
        dense = np.ascontiguousarray(right, dtype=np.float64)
        if dense.shape[0] != self.n:
            raise ValueError(f"the right-hand side has {dense.shape[0]} rows, the matrix {self.n}")
        return self._lu.solve(dense)


def factorise(matrix: sp.spmatrix) -> Factor:
    """Factorise a symmetric positive definite matrix; see `Factor`."""
    return Factor(matrix)
