"""Compiled inner loops over blocks of frames: renumbering, moving and smoothing.

A block holds B frames with the frames innermost, ``(V, 3, B)``: every operator then streams over contiguous memory
and the compiler vectorises over the frames. All of them release the interpreter lock, so blocks can run on threads.
No two arrays that are given to one function may share memory.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import scratch
from toolkit.compiled import ARITHMETIC, LOOPS, helper, njit

__all__ = [
    "add_shape",
    "block_to_frames",
    "chebyshev_of_average",
    "frames_to_block",
    "place_block",
    "renumber_frames",
]

# Vertices that are copied frame by frame together, so that whole cache lines are written.
_TILE = 64


@helper(**LOOPS)
def _frames_to_tile(frames, first, last, tile):
    """``tile[v - first, :, b] = frames[b, v]`` for vertices ``first <= v < last``."""
    for b in range(frames.shape[0]):
        for v in range(first, last):
            for k in range(3):
                tile[v - first, k, b] = frames[b, v, k]


@helper(**ARITHMETIC)
def _still_tile(tile, position, turns, shifts, rest, first, last, out):
    for v in range(first, last):
        x, p = tile[v - first], position[v]
        for k in range(3):
            place = rest[v, k]
            for b in range(out.shape[2]):
                moved = turns[k, 0, b] * x[0, b] + turns[k, 1, b] * x[1, b] + turns[k, 2, b] * x[2, b]
                out[p, k, b] = moved - (shifts[k, b] + place)


def frames_to_block(
    frames: NDArray[np.floating],
    position: NDArray[np.int64],
    turns: NDArray[np.floating],
    shifts: NDArray[np.floating],
    rest: NDArray[np.floating],
    out: NDArray[np.floating],
) -> None:
    """Move, renumber and subtract the rest: ``out[position[v], :, b] = turns_b frames[b, v] - shifts_b - rest[v]``.

    ``frames`` (B, V, 3), ``turns`` (3, 3, B), ``shifts`` (3, B), ``rest`` (V, 3), ``out`` (V, 3, B). In float64 up to
    the difference.
    """
    tile = scratch("tile", (_TILE, 3, len(frames)), frames.dtype)
    _frames_to_block(frames, position, turns, shifts, rest, tile, out)


@njit(**LOOPS)
def _frames_to_block(frames, position, turns, shifts, rest, tile, out):
    n_vertices = frames.shape[1]
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        _frames_to_tile(frames, first, last, tile)
        _still_tile(tile, position, turns, shifts, rest, first, last, out)


@njit(**ARITHMETIC)
def renumber_frames(frames, position, out):
    """Make a block ``(V, 3, B)`` of frames (B, V, 3) as they are: ``out[position[v], :, b] = frames[b, v]``."""
    n_vertices = frames.shape[1]
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        for b in range(frames.shape[0]):
            for v in range(first, last):
                for k in range(3):
                    out[position[v], k, b] = frames[b, v, k]


@njit(**ARITHMETIC)
def block_to_frames(block, position, out):
    """Give a block ``(V, 3, B)`` its original numbering back: ``out[b, v] = block[position[v], :, b]``."""
    n_vertices, _, n_frames = block.shape
    for first in range(0, n_vertices, _TILE):
        last = min(n_vertices, first + _TILE)
        for b in range(n_frames):
            for v in range(first, last):
                for k in range(3):
                    out[b, v, k] = block[position[v], k, b]


@njit(**ARITHMETIC)
def add_shape(block, shape, out):
    """``out[v, :, b] = block[v, :, b] + shape[v]``, ``block`` and ``out`` (V, 3, B), ``shape`` (V, 3)."""
    for v in range(len(block)):
        for k in range(3):
            for b in range(block.shape[2]):
                out[v, k, b] = block[v, k, b] + shape[v, k]


@njit(**ARITHMETIC)
def place_block(points, shift, turns, starts, out):
    """Sum and move: ``out[v, :, b] = turns_b (points + shift)[v, :, b] + starts_b``.

    ``points``, ``shift`` and ``out`` (V, 3, B), ``turns`` (3, 3, B) and ``starts`` (3, B) float32.
    """
    if points.shape[2] == 1:  # what is displayed: told so, the compiler needs a quarter of the time
        _place_frames(points, shift, turns, starts, out, 1)
    else:
        _place_frames(points, shift, turns, starts, out, points.shape[2])


@helper(forceinline=True, **ARITHMETIC)
def _place_frames(points, shift, turns, starts, out, n_frames):
    for v in range(len(points)):
        for b in range(n_frames):
            x, y, z = (
                points[v, 0, b] + shift[v, 0, b],
                points[v, 1, b] + shift[v, 1, b],
                points[v, 2, b] + shift[v, 2, b],
            )
            for k in range(3):
                out[v, k, b] = turns[k, 0, b] * x + turns[k, 1, b] * y + turns[k, 2, b] * z + starts[k, b]


@helper(**ARITHMETIC)
def _first_rows(coefficient, first, last, block, current, previous):
    """Rows ``first <= i < last`` of the recurrence's beginning: ``current <- coefficient block``, ``previous <- 0``."""
    for i in range(first, last):
        for c in range(block.shape[1]):
            current[i, c] = coefficient * block[i, c]
            previous[i, c] = 0


@helper(**ARITHMETIC)
def _average_rows(starts, neighbours, share, own, coefficient, first, last, block, current, previous):
    """Rows ``first <= i < last`` of ``previous <- coefficient block + own current - share A current - previous``.

    Four neighbours at a time: what is written is then read again a quarter as often.
    """
    n_columns = block.shape[1]
    for i in range(first, last):
        p, stop, s = starts[i], starts[i + 1], share[i]
        if p + 4 <= stop:
            j, k, m, n = neighbours[p], neighbours[p + 1], neighbours[p + 2], neighbours[p + 3]
            for c in range(n_columns):
                seen = (current[j, c] + current[k, c]) + (current[m, c] + current[n, c])
                previous[i, c] = coefficient * block[i, c] + own * current[i, c] - previous[i, c] - s * seen
            p += 4
        else:
            for c in range(n_columns):
                previous[i, c] = coefficient * block[i, c] + own * current[i, c] - previous[i, c]
        while p + 4 <= stop:
            j, k, m, n = neighbours[p], neighbours[p + 1], neighbours[p + 2], neighbours[p + 3]
            for c in range(n_columns):
                previous[i, c] -= s * ((current[j, c] + current[k, c]) + (current[m, c] + current[n, c]))
            p += 4
        while p < stop:
            j = neighbours[p]
            for c in range(n_columns):
                previous[i, c] -= s * current[j, c]
            p += 1


@njit(**ARITHMETIC)
def chebyshev_of_average(starts, neighbours, shares, own, coefficients, bounds, depth, block, out, spare):
    """``out <- sum_k c_k T_k(S) block`` (V, C) by Clenshaw's recurrence, ``S x = own x - share (sum over neighbours)``.

    ``neighbours[starts[i]:starts[i + 1]]`` are row i's; ``shares`` (2, V) are ``share`` and twice that.
    ``b_k = c_k block + 2 S b_(k+1) - b_(k+2)``; ``out`` and ``spare`` do for all of them, as a row of ``b_(k+2)`` is
    last needed where ``b_k`` takes its place.
    ``bounds`` cut the rows into chunks that have neighbours in the chunks beside them only. ``depth`` steps go over the
    rows together, each a chunk behind the step before it, so that a chunk is in the cache for all of them: memory is
    the bottleneck.
    """
    degree, n_chunks = len(coefficients) - 1, len(bounds) - 1
    done = 0
    while done <= degree:
        steps = min(depth, degree + 1 - done)
        for front in range(n_chunks + steps - 1):
            for step in range(max(0, front - n_chunks + 1), min(steps, front + 1)):
                first, last = bounds[front - step], bounds[front - step + 1]
                k = degree - done - step
                # Not swapped but chosen, since the steps of a front alternate; the last one writes to ``out``.
                read, write = (spare, out) if k % 2 == 0 else (out, spare)
                share, at = (shares[0], own) if k == 0 else (shares[1], own + own)
                if k == degree:
                    _first_rows(coefficients[k], first, last, block, write, read)
                else:
                    _average_rows(starts, neighbours, share, at, coefficients[k], first, last, block, read, write)
        done += steps
