"""Compiled substitution with a sparse triangular factor, for many right-hand sides at once.

Column j of ``L`` has ``values[starts[j]:starts[j + 1]]`` in ``rows``, the diagonal first.
"""

from __future__ import annotations

import numpy as np

from toolkit.compiled import ARITHMETIC, LOOPS, njit

__all__ = ["substitute", "without_zeros"]


@njit(**LOOPS)
def without_zeros(starts, rows, values):
    """The same ``L`` without the zeros that supernodes are filled up with; rows unsigned, which index faster."""
    count = np.count_nonzero(values)
    kept_starts, kept_rows, kept_values = np.zeros_like(starts), np.empty(count, np.uint32), np.empty(count)
    k = 0
    for j in range(len(starts) - 1):
        for p in range(starts[j], starts[j + 1]):
            if values[p] != 0:
                kept_rows[k], kept_values[k] = rows[p], values[p]
                k += 1
        kept_starts[j + 1] = k
    return kept_starts, kept_rows, kept_values


@njit(**ARITHMETIC)
def substitute(starts, rows, values, order, first, last, right, out):
    """``out <- A^-1 right`` in columns ``first <= c < last`` of both (n, m), for ``A[order][:, order] = L L^T``.

    Every number of ``L`` is read once for all columns, whose numbers in one row are next to each other.
    """
    n, width = len(order), last - first
    x = np.empty((n, width))
    for j in range(n):
        for c in range(width):
            x[j, c] = right[order[j], first + c]
    for j in range(n):
        scale = 1 / values[starts[j]]
        for c in range(width):
            x[j, c] *= scale
        for p in range(starts[j] + 1, starts[j + 1]):
            i, factor = rows[p], values[p]
            for c in range(width):
                x[i, c] -= factor * x[j, c]
    for j in range(n - 1, -1, -1):
        for p in range(starts[j] + 1, starts[j + 1]):
            i, factor = rows[p], values[p]
            for c in range(width):
                x[j, c] -= factor * x[i, c]
        scale = 1 / values[starts[j]]
        for c in range(width):
            x[j, c] *= scale
            out[order[j], first + c] = x[j, c]
