"""How far edits move each frame: what a timeline marks and the report shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import block_ranges
from toolkit.editing.stack import State

__all__ = ["moved_by", "n_moved"]

Array = NDArray[np.float64]

_SAMPLES = 3000


def moved_by(state: State) -> Array:
    """The largest displacement of each frame, ``(T,)``, in the result's unit.

    Of the large-scale shape at some thousand vertices, those where an edit takes hold among them, and of the details
    at all vertices; the larger of the two.
    """
    return np.maximum(_large_scale(state), _details(state)) * state.opened.placement.scale


def n_moved(moved: Array) -> int:
    """How many frames are moved to speak of: by 1 % or more of the one moved farthest."""
    farthest = float(moved.max(initial=0))
    return int(np.count_nonzero(moved >= 0.01 * farthest)) if farthest > 0 else 0


def _large_scale(state: State) -> Array:
    before, after = state.opened.take, state.take
    if after.weights is before.weights and not after.edits:
        return np.zeros(before.n_frames)
    ids = np.linspace(0, before.n_vertices - 1, min(_SAMPLES, before.n_vertices)).astype(np.int64)
    peaks = [np.abs(edit.responses).argmax(axis=0) for edit in after.edits]
    ids = np.unique(np.concatenate([ids, *peaks]))
    plain = before.moves_at(ids).reshape(before.n_bases, -1)
    edited = after.moves_at(ids).reshape(before.n_bases, -1)
    farthest = np.empty(before.n_frames)
    for start, stop in block_ranges(before.n_frames, 256):
        apart = after.weights[start:stop] @ edited - before.weights[start:stop] @ plain
        squared = np.sum(apart.reshape(stop - start, -1, 3) ** 2, axis=2)
        farthest[start:stop] = np.sqrt(squared.max(axis=1, initial=0))
    return farthest


def _details(state: State) -> Array:
    opened = state.opened
    farthest = np.zeros(opened.take.n_frames)
    if not state.changes:
        return farthest
    vertices = np.unique(np.concatenate([change.vertices for change in state.changes]))
    own = opened.target.rest.detail[vertices]
    static = own.copy()
    for change in state.changes:
        change.apply_static(static, vertices)
    farthest += np.sqrt(np.sum((static - own) ** 2, axis=1).max())
    first = max(min(change.window[0] for change in state.changes), 0)
    last = min(max(change.window[1] for change in state.changes), len(farthest) - 1)
    gain = opened.gain[vertices, None].astype(np.float32)
    for t in range(first, last + 1):
        plain = opened.details[t : t + 1, vertices] * gain
        changed = plain.copy()
        for change in state.changes:
            change.apply(changed, t, vertices)
        farthest[t] += np.sqrt(np.sum((changed - plain) ** 2, axis=2).max())
    return farthest
