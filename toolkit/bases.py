"""Choosing a few bases from the take, and non-negative weights for every frame (the paper's section 4.1, Eqs. 6-7).

In delta form, ``S~_t - S~_0 = sum_i w_ti (b_i - S~_0)`` with ``w >= 0``, so the result does not depend on where the
origin is. The candidates are the frames themselves. Everything after the Gram matrix of the frames is small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import map_blocks, scratch
from toolkit.compiled import ARITHMETIC, helper, njit
from toolkit.errors import InputError
from toolkit.progress import Progress, silent
from toolkit.steadying import steady_weights

__all__ = ["BasisParameters", "BasisSelection", "gram_matrix", "non_negative_weights", "select_bases"]

Array = NDArray[np.float64]

_SHORT_LIST = 6
_CHUNK_COLUMNS = 16384
_EXACT = 1e-6
"""Share of the motion below which nothing is left out that could tremble."""
_AT_REST = 1e-12
"""Share of the largest frame's energy below which a frame is the rest pose."""
_WEAKER = np.array([1.0, 0.25, 0.0625])
_STEADY_COST = 1.05
"""Steady weights may cost so much in RMS error, or all that the threshold leaves; else they are steadied less."""


@dataclass(frozen=True)
class BasisParameters:
    """When to stop adding bases: whichever comes first.

    ``threshold`` root mean square error as a share of the take's own RMS motion (0 makes every moving frame a basis);
    ``threshold_length`` the same as a length in mesh units, if given; ``count`` the most bases, if given.
    ``contact_share`` is how much the gaps of lids and lips count in the fit, beside the vertices; ``steadiness`` how
    much it sees the frames before and after (`toolkit.steadying`), 0 to fit every frame alone as the paper does.
    """

    threshold: float = 0.03
    threshold_length: float | None = None
    count: int | None = None
    contact_share: float = 1.0
    steadiness: float = 4.0

    def __post_init__(self) -> None:
        wrong = self.threshold < 0 or (self.threshold_length or 0) < 0 or (self.count is not None and self.count < 1)
        if wrong or self.steadiness < 0 or self.contact_share < 0:
            raise InputError(
                f"bases with threshold = {self.threshold}, threshold_length = {self.threshold_length}, "
                f"count = {self.count}, contact_share = {self.contact_share}, steadiness = {self.steadiness} make no "
                "sense",
                remedy="give a count of at least 1, and nothing negative",
            )


@dataclass(frozen=True)
class BasisSelection:
    """The chosen bases and their weights.

    ``frames`` (K,) indices of the chosen frames, in the order of choice; ``weights`` (T, K), non-negative; ``errors``
    (K + 1,) RMS error over all vertices and frames with 0, 1, ... K bases, in mesh units; ``frame_errors`` (T,) RMS
    error of each frame with all K.
    """

    frames: NDArray[np.int64]
    weights: Array
    errors: Array
    frame_errors: Array


def gram_matrix(deltas: NDArray[np.floating], progress: Progress = silent) -> Array:
    """``G = X X^T`` of the frames' deltas ``(T, V, 3)``, ``(T, T)``; possibly memory-mapped, read in columns."""
    flat = deltas.reshape(len(deltas), -1)
    products = {}

    def work(start: int, stop: int) -> None:
        columns = scratch("columns", (len(flat), stop - start), flat.dtype)
        columns[:] = flat[:, start:stop]
        products[start] = columns @ columns.T  # single precision inside a chunk, double over chunks

    map_blocks(work, flat.shape[1], _CHUNK_COLUMNS, what="comparing frames", progress=progress)
    total = np.zeros((len(flat), len(flat)))
    for start in sorted(products):  # always in this order, whichever was done first
        total += products[start]
    return total


def select_bases(
    gram: Array,
    n_vertices: int,
    parameters: BasisParameters | None = None,
    gaps: NDArray[np.floating] | None = None,
    progress: Progress = silent,
) -> BasisSelection:
    """Greedy choice (Eq. 7): each step adds the frame that lowers the total error most.

    ``gram`` (T, T) from `gram_matrix`. ``gaps`` (T, P, 3), if given, are the contact pairs' gaps less those at rest;
    the choice and the weights then see their mean square beside that of the vertices, times
    ``parameters.contact_share``. Errors are always those of the vertices. The six frames that explain most of what is
    left, taken one by one, are tried exactly. Still takes have no bases: K = 0.
    """
    parameters = parameters or BasisParameters()
    positions = gram
    if gaps is not None and gaps.size:
        rows = gaps.reshape(len(gaps), -1)
        gram = gram + (parameters.contact_share * n_vertices / gaps.shape[1]) * (rows @ rows.T)
    energy = np.diag(gram)
    moved = float(np.trace(positions))
    per_length = 1 / max(len(gram) * n_vertices, 1)
    motion = np.sqrt(max(moved, 0) * per_length)
    goal = parameters.threshold * motion
    if parameters.threshold_length is not None:
        goal = max(goal, parameters.threshold_length) if parameters.threshold else parameters.threshold_length
    limit = min(parameters.count or len(gram), len(gram))
    alive = energy > _AT_REST * max(float(energy.max(initial=0)), 1e-300)
    frames: list[int] = []
    weights = np.zeros((len(gram), 0))
    errors = [motion]
    while len(frames) < limit and errors[-1] > goal and alive.any():
        candidate = _best_candidate(gram, frames, weights, alive)
        if candidate is None:
            break
        index, weights = candidate
        frames.append(index)
        alive[index] = False
        squared = _squared_errors(positions, np.array(frames), weights)
        errors.append(float(np.sqrt(squared.sum() * per_length)))
        progress("choosing bases", len(frames), limit)
    if parameters.threshold == 0 and parameters.threshold_length is None and len(frames) < limit:
        # What is left differs by less than the Gram matrix can tell; zero was asked for, so each is its own basis.
        rest = np.flatnonzero(alive)[: limit - len(frames)]
        frames += rest.tolist()
        weights = np.column_stack([weights, np.zeros((len(gram), len(rest)))])
        weights[frames] = np.eye(len(frames))
        errors += [errors[-1]] * (len(rest) - 1) + [0.0] * bool(len(rest))
    chosen = np.array(frames, dtype=np.int64)
    squared = _squared_errors(positions, chosen, weights)
    if frames and errors[-1] > _EXACT * motion:
        allowed = max(goal, _STEADY_COST * errors[-1]) ** 2 / per_length
        weights, squared = _steadied(gram, positions, chosen, weights, squared, parameters.steadiness, allowed)
        errors[-1] = float(np.sqrt(squared.sum() * per_length))
    return BasisSelection(chosen, weights, np.array(errors), np.sqrt(squared / n_vertices))


def _steadied(
    gram: Array,
    positions: Array,
    chosen: NDArray[np.int64],
    weights: Array,
    squared: Array,
    steadiness: float,
    most: float,
) -> tuple[Array, Array]:
    """The steadiest weights whose squared errors sum to no more than ``most``, and these errors (T,)."""
    energy = np.diag(gram)
    inner, at_rest = gram[np.ix_(chosen, chosen)], energy <= _AT_REST * energy.max()
    # What the weights' own bends count: nothing, where nothing is left out.
    bend = float(squared.sum() / np.trace(positions))
    for strength in steadiness * _WEAKER:
        steady = steady_weights(inner, gram[:, chosen], weights, float(strength), at_rest, bend=bend)
        left = _squared_errors(positions, chosen, steady, exact=False)
        if left.sum() <= most:
            return steady, left
    return weights, squared


def _best_candidate(
    gram: Array, frames: list[int], weights: Array, alive: NDArray[np.bool_]
) -> tuple[int, Array] | None:
    """The frame to add, with the weights (T, K + 1) that it gives."""
    gains = _explained(gram, frames, weights)
    gains[~alive] = -1
    short_list = np.argsort(-gains, kind="stable")[:_SHORT_LIST]
    short_list = short_list[gains[short_list] >= 0]
    best: tuple[int, Array] | None = None
    least = np.inf
    for index in short_list:
        chosen = np.array([*frames, index], dtype=np.int64)
        start = np.column_stack([weights, np.zeros(len(gram))])
        trial = non_negative_weights(gram[np.ix_(chosen, chosen)], gram[:, chosen], start)
        # A basis is its own frame exactly, whatever rounding the Gram matrix has.
        trial[chosen] = np.eye(len(chosen))
        total = float(_squared_errors(gram, chosen, trial).sum())
        if total < least:
            best, least = (int(index), trial), total
    return best


def _explained(gram: Array, frames: list[int], weights: Array) -> Array:
    """For each frame, how much of the residuals it would explain alone: ``sum_t max(0, r_t . r_c)^2 / |r_c|^2``."""
    inner = gram[np.ix_(frames, frames)]
    half = gram[frames] - 0.5 * inner @ weights.T
    # What the bases explain of the products of frames, W H + (W H)^T, (T, T).
    reached = np.concatenate([weights, half.T], axis=1) @ np.concatenate([half, weights.T])
    explained = np.zeros(len(gram))
    _add_positive_squares(gram, reached, explained)
    own = np.diag(gram) - np.diag(reached)
    floor = 1e-9 * max(float(np.diag(gram).max()), 1e-300)
    return np.where(own > floor, explained / np.maximum(own, floor), 0.0)


@njit(**ARITHMETIC)
def _add_positive_squares(gram, reached, sums):  # type: ignore[no-untyped-def]  # compiled
    """``sums[c] += sum_t max(0, gram[t, c] - reached[t, c])^2``: one pass, where whole arrays would take six."""
    for t in range(len(gram)):
        row, known = gram[t], reached[t]
        for c in range(len(sums)):
            left = max(row[c] - known[c], 0.0)
            sums[c] += left * left


def _squared_errors(gram: Array, frames: NDArray[np.int64], weights: Array, *, exact: bool = True) -> Array:
    """Squared errors ``(T,)`` of all vertices; ``exact`` where every basis is its own frame."""
    inner = gram[np.ix_(frames, frames)]
    squared = (
        np.diag(gram)
        - 2 * np.einsum("tk,tk->t", weights, gram[:, frames])
        + np.einsum("tk,tk->t", weights @ inner, weights)
    )
    squared = np.maximum(squared, 0)
    if exact:
        squared[frames] = 0
    return squared


def non_negative_weights(inner: Array, coupling: Array, start: Array | None = None) -> Array:
    """``argmin_w |B w_t - x_t|^2, w_t >= 0`` for every frame, ``(T, K)``, by Lawson and Hanson's active sets.

    ``inner`` (K, K) = B^T B, ``coupling`` (T, K) = x_t^T B; ``start`` (T, K) an earlier solution to begin from. The
    paper uses the solver of James and Twigg 2005, which finds the same minimum.
    """
    if start is None:
        start = np.zeros_like(coupling)
    scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    # In units of each basis' own size, so that one tolerance serves weak and strong ones.
    scaled = inner / np.outer(scale, scale)
    weights = np.ascontiguousarray(np.maximum(start, 0) * scale)
    n_bases = len(inner)
    room = np.empty((n_bases, n_bases)), np.empty(n_bases), np.empty(n_bases, np.int64), np.empty(n_bases, np.bool_)
    _active_sets(scaled, np.ascontiguousarray(coupling / scale), weights, room)
    return weights / scale


# Plain loops: what numba brings for arrays and linear algebra takes seconds to compile and to load.
@helper(nogil=True, error_model="numpy")
def _solve_passive(inner, right, passive, root, ids, trial):  # type: ignore[no-untyped-def]  # compiled
    """Least squares on the passive set alone, zero elsewhere, to ``trial``; ``root`` and ``ids`` are scratch."""
    n = 0
    for k in range(len(right)):
        trial[k] = 0.0
        if passive[k]:
            ids[n] = k
            n += 1
    for a in range(n):
        value = right[ids[a]]
        for b in range(a + 1):
            entry = inner[ids[a], ids[b]]
            for c in range(b):
                entry -= root[a, c] * root[b, c]
            # Frames that nearly repeat each other must not make the small system singular.
            root[a, b] = np.sqrt(max(entry, 0.0) + 1e-12) if a == b else entry / root[b, b]
            if b < a:
                value -= root[a, b] * trial[ids[b]]
        trial[ids[a]] = value / root[a, a]
    for a in range(n - 1, -1, -1):
        value = trial[ids[a]]
        for c in range(a + 1, n):
            value -= root[c, a] * trial[ids[c]]
        trial[ids[a]] = value / root[a, a]


@helper(nogil=True, error_model="numpy")
def _steepest(inner, right, w, passive, tolerance):  # type: ignore[no-untyped-def]  # compiled
    """The active weight whose growth lowers the error most, or -1."""
    best, best_value = -1, tolerance
    for k in range(len(w)):
        if not passive[k]:
            gradient = right[k]
            for i in range(len(w)):
                gradient -= inner[k, i] * w[i]
            if gradient > best_value:
                best, best_value = k, gradient
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _active_sets(inner, coupling, weights, room):  # type: ignore[no-untyped-def]  # compiled
    n_frames, n_bases = coupling.shape
    root, trial, ids, passive = room
    for t in range(n_frames):
        right, w = coupling[t], weights[t]
        tolerance = 1e-300
        for k in range(n_bases):
            tolerance = max(tolerance, 1e-10 * abs(right[k]))
            passive[k] = w[k] > 0
        for turn in range(10 * n_bases + 10):
            if turn > 0:
                best = _steepest(inner, right, w, passive, tolerance)
                if best < 0:
                    break
                passive[best] = True
            for _ in range(3 * n_bases + 3):
                _solve_passive(inner, right, passive, root, ids, trial)
                step, blocking = 1.0, -1
                for k in range(n_bases):
                    if passive[k] and trial[k] <= 0:
                        ratio = w[k] / (w[k] - trial[k]) if w[k] > trial[k] else 0.0
                        if ratio < step:
                            step, blocking = ratio, k
                for k in range(n_bases):
                    w[k] += step * (trial[k] - w[k])
                    if blocking >= 0 and passive[k] and (k == blocking or w[k] <= 1e-14):
                        passive[k] = False
                        w[k] = 0.0
                if blocking < 0:
                    break
        for k in range(n_bases):
            w[k] = max(w[k], 0.0)
