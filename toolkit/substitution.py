"""Compiled substitution with a sparse triangular factor, for many right-hand sides at once.

``lower`` is ``L`` by columns, a tuple of ``starts`` (n + 1,), ``rows`` and ``values``: column j has
``values[starts[j]:starts[j + 1]]`` in ``rows``, the diagonal first. ``A[order][:, order] = L L^T``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import aligned_empty
from toolkit.compiled import ARITHMETIC, LOOPS, njit

__all__ = ["Lower", "part_of", "substitute_backward", "substitute_forward", "with_ancestors", "without_zeros"]

# Columns are kept in whole vectors of the processor.
_VECTOR = 4

Array = NDArray[np.float64]
Ids = NDArray[np.integer]
Lower = tuple[NDArray[np.int64], NDArray[np.uint32], Array]


def without_zeros(starts: NDArray[np.int64], rows: Ids, values: Array) -> Lower:
    """The same ``L`` without the zeros that supernodes are filled up with; rows unsigned, which index faster."""
    count = np.count_nonzero(values != 0)  # of numbers themselves, it asks one by one
    kept = np.zeros_like(starts), np.empty(count, np.uint32), np.empty(count)
    _copy_nonzero(starts, rows, values, *kept)
    return kept


@njit(**LOOPS)
def _copy_nonzero(starts, rows, values, kept_starts, kept_rows, kept_values):
    k = 0
    for j in range(len(starts) - 1):
        for p in range(starts[j], starts[j + 1]):
            if values[p] != 0:
                kept_rows[k], kept_values[k] = rows[p], values[p]
                k += 1
        kept_starts[j + 1] = k


@njit(**LOOPS)
def with_ancestors(lower, wanted):
    """Add to ``wanted`` (n,) whatever forward substitution reaches from it: the elimination tree's ancestors."""
    starts, rows, _ = lower
    for j in range(len(wanted)):
        # A column's first row below the diagonal is its parent.
        if wanted[j] and starts[j] + 1 < starts[j + 1]:
            wanted[rows[starts[j] + 1]] = True


def part_of(lower: Lower, chosen: Ids) -> Lower:
    """The columns ``chosen`` (m,) of ``L``, ascending and with all their ancestors, in a numbering of their own."""
    starts = lower[0]
    number = np.empty(len(starts) - 1, np.uint32)
    number[chosen] = np.arange(len(chosen))
    part_starts = np.zeros(len(chosen) + 1, starts.dtype)
    np.cumsum(starts[chosen + 1] - starts[chosen], out=part_starts[1:])
    part_rows, part_values = np.empty(part_starts[-1], np.uint32), np.empty(part_starts[-1])
    _copy_columns(lower, chosen, number, part_rows, part_values)
    return part_starts, part_rows, part_values


@njit(**LOOPS)
def _copy_columns(lower, chosen, number, part_rows, part_values):
    starts, rows, values = lower
    at = 0
    for j in chosen:
        for p in range(starts[j], starts[j + 1]):
            part_rows[at], part_values[at] = number[rows[p]], values[p]
            at += 1


def substitute_forward(lower: Lower, order: Ids, first: int, last: int, right: Array) -> Array:
    """``L^-1 right[order]`` of columns ``first <= c < last`` of ``right`` (n, m), zeros added up to whole vectors.

    Every number of ``L`` is read once for all columns, whose numbers in one row are next to each other.
    """
    x = aligned_empty((len(order), -(-(last - first) // _VECTOR) * _VECTOR), np.float64)
    _substitute_forward(lower, order, first, last - first, right, x)
    return x


@njit(**ARITHMETIC)
def _substitute_forward(lower, order, first, wanted, right, x):
    starts, rows, values = lower
    width = x.shape[1]
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
