"""Weights that do not tremble: the fit of every frame sees its neighbours in time.

Fitted one by one, a frame that the bases cannot reach leaves a residual that comes and goes as weights reach zero and
leave it again: the take is smooth, its likeness has kinks, and they show where the face is calm. So the fit also asks
that the residual be smooth in time:

    min_{W >= 0}  |R|^2 + s |D2 R|^2 + e |D2 W|^2,    R = X - W B,    D2 the second differences over frames.

It does not smooth the motion itself, only what the bases leave out; where nothing is left out, nothing changes. The
last term, of weights in units of their bases' sizes, is next to nothing beside the others: where a basis nearly is a
mixture of others, weights can be one thing or another, and it chooses the steadiest. What is alike on the source is not
quite alike on the target, where single frames would hop.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.banded import FrameBands
from toolkit.bounded import LinearSystem, minimise

__all__ = ["steady_weights"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

# The least that any mixture of bases of unit size must cost for its share in the weights to be told by the frames.
_DEFINITE = 1e-9


def steady_weights(
    inner: Array,
    coupling: Array,
    start: Array,
    strength: float,
    held: Bools | None = None,
    *,
    bend: float = 0.0,
) -> Array:
    """Minimise the above from ``start`` (T, K), the weights fitted frame by frame; ``(T, K)``, non-negative.

    ``inner`` (K, K) = B B^T, ``coupling`` (T, K) = X B^T, frames in their order in time; ``strength`` s and ``bend`` e
    in frames^4; frames that are ``held`` (T,) keep the weights they have: at rest, all must stay at rest.
    """
    free = np.full(len(start), True) if held is None else ~held
    if strength == 0 or len(start) < 3 or start[free].size == 0:
        return start
    change = _Change(inner, coupling, start, strength, bend, free)
    weights = start.copy()
    weights[free] = np.maximum(start[free] + minimise(change, -start[free], np.zeros_like(start[free])), 0)
    return weights


class _Change:
    """What a change ``u`` (n, K) of the free frames' weights costs.

    ``(I + s D2^T D2) (x) G + e D2^T D2 (x) diag(G)`` and its linear part.
    """

    def __init__(self, inner: Array, coupling: Array, start: Array, strength: float, bend: float, free: Bools) -> None:
        second = sp.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(len(start) - 2, len(start)))
        bent = sp.csr_matrix(second.T @ second)[free]
        time = sp.csr_matrix(sp.identity(len(start)))[free] + strength * bent
        sizes = bend * np.diag(np.diag(inner))
        self._offset = np.asarray(time @ (start @ inner - coupling) + bent @ (start @ sizes))
        # Frames keep their order, so five bands remain five.
        self._terms = [(time[:, free], _definite(inner)), (bent[:, free], sizes)]
        self._bands = FrameBands(self._terms)

    @property
    def diagonal(self) -> Array:
        """Of the matrix, (n, K)."""
        return self._bands.diagonal

    def gradient(self, change: Array) -> Array:
        """Half of it, (n, K)."""
        return np.asarray(sum(time @ (change @ small) for time, small in self._terms)) + self._offset

    def system(self, *, extra: Array | None = None, stuck: Bools | None = None) -> LinearSystem:
        """As `toolkit.bounded` asks for it."""
        return self._bands.factor(extra, stuck)


def _definite(inner: Array) -> Array:
    """``inner`` and as much of its diagonal as makes it safely definite, in spite of rounding."""
    size = np.where(np.diag(inner) > 0, np.diag(inner), 1.0)
    root = np.sqrt(size)
    least = float(np.linalg.eigvalsh(inner / np.outer(root, root))[0])
    return np.asarray(inner + max(_DEFINITE - least, 0.0) * np.diag(size))
