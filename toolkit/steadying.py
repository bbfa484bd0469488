"""Weights that do not tremble: the fit of every frame sees its neighbours in time.

Fitted one by one, a frame that the bases cannot reach leaves a residual that comes and goes as weights reach zero and
leave it again: the take is smooth, its likeness has kinks, and they show where the face is calm. So the fit also asks
that the residual be smooth in time:

    min_{W >= 0}  |R|^2 + s |D2 R|^2,    R = X - W B,    D2 the second differences over frames.

It does not smooth the motion itself, only what the bases leave out; where nothing is left out, nothing changes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["steady_weights"]

Array = NDArray[np.float64]

_MOST_STEPS = 2000
_TOLERANCE = 1e-7


def steady_weights(
    inner: Array, coupling: Array, start: Array, strength: float, held: NDArray[np.bool_] | None = None
) -> Array:
    """Minimise the above from ``start`` (T, K), the weights fitted frame by frame; ``(T, K)``, non-negative.

    ``inner`` (K, K) = B B^T, ``coupling`` (T, K) = X B^T, frames in their order in time; ``strength`` s, in frames^4;
    frames that are ``held`` (T,) keep the weights they have: at rest, all must stay at rest.
    Nesterov's projected gradient steps, restarted where they would climb (O'Donoghue and Candes 2015).
    """
    if strength == 0 or len(start) < 3 or start.shape[1] == 0:
        return start
    scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    # In units of each basis' own size, so that one step serves weak and strong ones.
    scaled, right = inner / np.outer(scale, scale), coupling / scale
    # The largest eigenvalue of D2^T D2 is below 16.
    step = 1 / ((1 + 16 * strength) * float(np.linalg.eigvalsh(scaled)[-1]))
    weights = start * scale
    ahead, momentum = weights, 1.0
    enough = _TOLERANCE * max(float(weights.max()), 1e-300)
    for _ in range(_MOST_STEPS):
        gradient = _coupled(ahead @ scaled - right, strength)
        if held is not None:
            gradient[held] = 0
        moved = np.maximum(ahead - step * gradient, 0)
        change = moved - weights
        if np.abs(change).max() < enough:
            weights = moved
            break
        if np.sum(gradient * change) > 0:
            momentum = 1.0
        following = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
        ahead = moved + (momentum - 1) / following * change
        weights, momentum = moved, following
    return weights / scale


def _coupled(rows: Array, strength: float) -> Array:
    """``(I + s D2^T D2) rows`` for rows over time ``(T, K)``."""
    bends = strength * (rows[2:] - 2 * rows[1:-1] + rows[:-2])
    out = rows.copy()
    out[2:] += bends
    out[1:-1] -= 2 * bends
    out[:-2] += bends
    return out
