"""Lanczos' recurrence, compiled, on several starting vectors side by side."""

from __future__ import annotations

import numpy as np

from toolkit.compiled import njit

__all__ = ["lanczos_steps"]


@njit(cache=True, nogil=True, fastmath=False, boundscheck=False)
def lanczos_steps(indptr, indices, values, basis, alphas, betas, start, stop):
    """Steps ``start <= j < stop`` for a symmetric matrix in CSR form.

    ``basis`` (J + 1, c, n) holds the vectors up to ``start`` and takes the next ones; ``alphas`` and ``betas`` (J, c)
    are the diagonals and subdiagonals of the tridiagonal matrices.
    """
    columns, n = basis.shape[1], basis.shape[2]
    for j in range(start, stop):
        for c in range(columns):
            current, after = basis[j, c], basis[j + 1, c]
            alpha = 0.0
            for i in range(n):
                total = 0.0
                for p in range(indptr[i], indptr[i + 1]):
                    total += values[p] * current[indices[p]]
                after[i] = total
                alpha += total * current[i]
            alphas[j, c] = alpha
            if j > 0:
                before, beta = basis[j - 1, c], betas[j - 1, c]
                for i in range(n):
                    after[i] -= alpha * current[i] + beta * before[i]
            else:
                for i in range(n):
                    after[i] -= alpha * current[i]
            square = 0.0
            for i in range(n):
                square += after[i] * after[i]
            beta = np.sqrt(square)
            betas[j, c] = beta
            scale = 1.0 / beta if beta > 1e-300 else 0.0
            for i in range(n):
                after[i] *= scale
