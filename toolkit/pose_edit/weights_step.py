"""The weights' side of an edit: a bounded least squares problem over the window, banded in time.

With ``u = w' - w`` the change of the weights, ``(n, K)`` over the window's n frames,

    min_u  sum_k u_k^T Q u_k + sum_t u_t^T G u_t + (r - B u)^T M^-1 (r - B u),    u >= -w

``Q`` holds what changes in time cost, ``G`` what moving the fixed vertices costs, ``B`` how the few constrained frames
answer. Solved by a primal-dual active set method: with the set of weights that are zero given, what is left is banded
(plus the few rows of ``B``, by Woodbury's formula); the set is then corrected all at once, and rarely needs more than
ten corrections, fewer still when it starts from the last edit's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

__all__ = ["WeightsProblem", "time_matrix"]

Array = NDArray[np.float64]

_MOST_CORRECTIONS = 60
# Corrections that may fail to improve before only one weight is exchanged at a time (Judice and Pires).
_PATIENCE = 8


def time_matrix(n: int, tied_before: bool, tied_after: bool, smoothness: float) -> sp.csr_matrix:
    """``Q`` (n, n): squared velocities (Eq. 13) and, times ``smoothness``^2 (frames), squared accelerations.

    Velocities alone leave kinks where the window begins, at the edited frame, and where it ends. A tied end borders on
    frames that do not change, so value and speed join there; an end that is the take's own is free. A faint pull
    to the unedited curve, 1 / n^2, settles what neither says (the paper's term leaves a constant free).
    """
    before, after = 2 * tied_before, 2 * tied_after
    total = before + n + after
    inside = slice(before, before + n)
    velocity = sp.csr_matrix(sp.diags([-1.0, 1.0], [0, 1], shape=(max(total - 1, 0), total)))[:, inside]
    acceleration = sp.csr_matrix(sp.diags([1.0, -2.0, 1.0], [0, 1, 2], shape=(max(total - 2, 0), total)))[:, inside]
    bent = smoothness**2 * (acceleration.T @ acceleration)
    return sp.csr_matrix(velocity.T @ velocity + bent + sp.identity(n) / n**2)


@dataclass(frozen=True)
class WeightsProblem:
    """What stays the same: ``time`` = Q (n, n), five bands, ``gram`` = G (K, K) or None, ``lower`` = -w (n, K)."""

    time: sp.csr_matrix
    gram: Array | None
    lower: Array

    def cost(self, change: Array) -> float:
        """What the change ``u`` (n, K) costs, constraints aside."""
        return float(np.sum(change * self.force(change)))

    def force(self, change: Array) -> Array:
        """``Q u + u G``, (n, K)."""
        force = np.asarray(self.time @ change)
        return force if self.gram is None else force + change @ self.gram

    def solve(self, rows: Array, goals: Array, metric: Array, start: Array) -> Array:
        """The best change (n, K) for rows ``B`` (R, n, K), goals ``r`` (R,) and metric ``M`` (R, R).

        ``start`` (n, K) is an earlier solution: the weights that it makes zero are the first guess.
        """
        lower = self.lower
        active = start <= lower
        size = max(float(np.abs(lower).max(initial=0)), 1e-12)
        fewest, patience = active.size + 1, _PATIENCE
        change = start
        for _ in range(_MOST_CORRECTIONS):
            change, pull = self._with_active(active, rows, goals, metric)
            force = self.force(change) - np.tensordot(pull, rows, axes=1)
            tolerance = 1e-9 * max(float(np.abs(force[active]).max(initial=0)), 1e-300)
            below = ~active & (change < lower - 1e-12 * size)
            wanting = active & (force < -tolerance)
            wrong = below | wanting
            count = int(wrong.sum())
            if count == 0:
                break
            if count < fewest:
                fewest, patience = count, _PATIENCE
            elif patience > 0:
                patience -= 1
            else:
                wrong = np.zeros_like(wrong)
                wrong.flat[np.flatnonzero(below | wanting)[-1]] = True
            active = active ^ wrong
        return np.maximum(change, lower)

    def _with_active(self, active: NDArray[np.bool_], rows: Array, goals: Array, metric: Array) -> tuple[Array, Array]:
        """The solution with the active weights at their bound, and ``M^-1 (r - B u)``."""
        bound = np.where(active, self.lower, 0.0)
        right = -self.force(bound)
        right[active] = 0
        open_rows = np.where(active, 0.0, rows)
        left = goals - np.tensordot(rows, bound, axes=2)
        solved = self._solve_banded(active, np.concatenate([right[None], open_rows]))
        answer = np.tensordot(open_rows, solved, axes=([1, 2], [1, 2]))  # (R, 1 + R)
        pull = np.linalg.solve(metric + answer[:, 1:], left - answer[:, 0]) if len(goals) else left
        return bound + solved[0] + np.tensordot(pull, solved[1:], axes=1), pull

    def _solve_banded(self, active: NDArray[np.bool_], right: Array) -> Array:
        """Solve on the free weights for right-hand sides (R, n, K), zero at the active ones."""
        n, n_bases = active.shape
        bands = [np.zeros(n) for _ in range(3)]
        for offset in range(min(3, n)):
            bands[offset][: n - offset] = self.time.diagonal(offset)
        if self.gram is None:
            # Without fixed vertices each weight's curve is a chain of its own: five bands in all.
            free = ~active.T.ravel()
            matrix = np.stack([np.tile(band, n_bases) for band in bands])
            columns = right.transpose(2, 1, 0).reshape(n * n_bases, -1)
        else:
            free = ~active.ravel()
            matrix = _frame_bands(bands, self.gram, n)
            columns = right.transpose(1, 2, 0).reshape(n * n_bases, -1)
        for offset in range(len(matrix)):
            length = max(len(free) - offset, 0)
            matrix[offset, :length] *= free[:length] & free[len(free) - length :]
            matrix[offset, length:] = 0
        matrix[0, ~free] = 1
        factor = cholesky_banded(matrix, overwrite_ab=True, lower=True, check_finite=False)
        solved = cho_solve_banded((factor, True), columns, check_finite=False)
        if self.gram is None:
            return np.asarray(solved.reshape(n_bases, n, -1).transpose(2, 1, 0))
        return np.asarray(solved.reshape(n, n_bases, -1).transpose(2, 0, 1))


def _frame_bands(bands: list[Array], gram: Array, n: int) -> Array:
    """Frame by frame: the fixed vertices couple the weights of a frame, time couples a frame with the next two."""
    n_bases = len(gram)
    matrix = np.zeros((2 * n_bases + 1, n * n_bases))
    for offset in range(n_bases):
        within = np.zeros(n_bases)
        within[: n_bases - offset] = np.diagonal(gram, offset)
        matrix[offset] = np.tile(within, n)
    for step, band in enumerate(bands):
        matrix[step * n_bases] += np.repeat(band, n_bases)
    return matrix
