"""Lanczos' recurrence, compiled, on three starting vectors side by side."""

from __future__ import annotations

import numpy as np

from toolkit.compiled import njit

__all__ = ["lanczos_steps"]


@njit(cache=True, nogil=True, fastmath=False, boundscheck=False)
def lanczos_steps(indptr, indices, values, basis, alphas, betas, start, stop):
    """Steps ``start <= j < stop`` for a symmetric matrix in CSR form.

    ``basis`` (3, J + 1, n) holds the vectors up to ``start`` and takes the next ones; ``alphas`` and ``betas`` (3, J)
    are the diagonals and subdiagonals of the tridiagonal matrices.
    """
    n = basis.shape[2]
    together = np.empty((n, 3))  # so that each entry of the matrix is read once for all three
    for j in range(start, stop):
        for c in range(3):
            for i in range(n):
                together[i, c] = basis[c, j, i]
        for i in range(n):
            x, y, z = 0.0, 0.0, 0.0
            for p in range(indptr[i], indptr[i + 1]):
                k, value = indices[p], values[p]
                x += value * together[k, 0]
                y += value * together[k, 1]
                z += value * together[k, 2]
            basis[0, j + 1, i], basis[1, j + 1, i], basis[2, j + 1, i] = x, y, z
        for c in range(3):
            before, current, after = basis[c, max(j - 1, 0)], basis[c, j], basis[c, j + 1]
            alpha, square = 0.0, 0.0
            beta = betas[c, j - 1] if j > 0 else 0.0
            for i in range(n):
                alpha += after[i] * current[i]
            for i in range(n):
                after[i] -= alpha * current[i] + beta * before[i]
                square += after[i] * after[i]
            beta = np.sqrt(square)
            alphas[c, j], betas[c, j] = alpha, beta
            scale = 1.0 / beta if beta > 1e-300 else 0.0
            for i in range(n):
                after[i] *= scale
