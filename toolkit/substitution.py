"""Compiled substitution with a sparse triangular factor, for many right-hand sides at once.

``lower`` is ``L`` by columns, a tuple of ``starts`` (n + 1,), ``rows`` and ``values``: column j has
``values[starts[j]:starts[j + 1]]`` in ``rows``, the diagonal first. ``A[order][:, order] = L L^T``.
"""

from __future__ import annotations

import numpy as np

from toolkit.compiled import ARITHMETIC, LOOPS, njit

__all__ = ["part_of", "substitute_backward", "substitute_forward", "with_ancestors", "without_zeros"]

# Columns are kept in whole vectors of the processor.
_VECTOR = 4


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


@njit(**LOOPS)
def with_ancestors(lower, wanted):
    """Add to ``wanted`` (n,) whatever forward substitution reaches from it: the elimination tree's ancestors."""
    starts, rows, _ = lower
    for j in range(len(wanted)):
        # A column's first row below the diagonal is its parent.
        if wanted[j] and starts[j] + 1 < starts[j + 1]:
            wanted[rows[starts[j] + 1]] = True


@njit(**LOOPS)
def part_of(lower, chosen):
    """The columns ``chosen`` (m,) of ``L``, ascending and with all their ancestors, in a numbering of their own."""
    starts, rows, values = lower
    number = np.empty(len(starts) - 1, np.uint32)
    part_starts = np.zeros(len(chosen) + 1, starts.dtype)
    for k, j in enumerate(chosen):
        number[j] = k
        part_starts[k + 1] = part_starts[k] + starts[j + 1] - starts[j]
    part_rows, part_values = np.empty(part_starts[-1], np.uint32), np.empty(part_starts[-1])
    for k, j in enumerate(chosen):
        at = part_starts[k]
        for p in range(starts[j], starts[j + 1]):
            part_rows[at], part_values[at] = number[rows[p]], values[p]
            at += 1
    return part_starts, part_rows, part_values


@njit(**ARITHMETIC)
def substitute_forward(lower, order, first, last, right):
    """``L^-1 right[order]`` of columns ``first <= c < last`` of ``right`` (n, m), zeros added up to whole vectors.

    Every number of ``L`` is read once for all columns, whose numbers in one row are next to each other.
    """
    starts, rows, values = lower
    wanted, width = last - first, -(-(last - first) // _VECTOR) * _VECTOR
    x = np.empty((len(order), width))
    for j in range(len(order)):
        for c in range(wanted):
            x[j, c] = right[order[j], first + c]
        for c in range(wanted, width):
            x[j, c] = 0
    for j in range(len(order)):
        scale = 1 / values[starts[j]]
        for c in range(width):
            x[j, c] *= scale
        for p in range(starts[j] + 1, starts[j + 1]):
            i, factor = rows[p], values[p]
            for c in range(width):
                x[i, c] -= factor * x[j, c]
    return x


@njit(**ARITHMETIC)
def substitute_backward(lower, order, x, first, last, out):
    """``out[order] <- L^-T x`` in columns ``first <= c < last`` of ``out`` (n, m); ``x`` is spent."""
    starts, rows, values = lower
    width = x.shape[1]
    for j in range(len(order) - 1, -1, -1):
        for p in range(starts[j] + 1, starts[j + 1]):
            i, factor = rows[p], values[p]
            for c in range(width):
                x[j, c] -= factor * x[i, c]
        scale = 1 / values[starts[j]]
        for c in range(width):
            x[j, c] *= scale
        for c in range(last - first):
            out[order[j], first + c] = x[j, c]
