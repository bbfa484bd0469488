"""Taking the head's rigid motion out of a take, and putting it back on the result (method, section 1).

Without it a turning head leaks into the bases and the wrinkles. The motion is fitted on the vertices that are seen to
move least against each other; their weights are the same for all frames, so the fit adds no jitter of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.meshio.sequence import FrameSequence
from toolkit.progress import Progress, silent
from toolkit.rigid import Similarity

__all__ = ["HeadMotion", "fit_head_motion", "rigid_fits", "stable_weights"]

Array = NDArray[np.float64]

_SAMPLE = 2000
_ROUNDS = 12
_STABLE_SHARE = 0.2
_ROUNDING = 1e-7
"""Share of the face's size below which a residual is rounding: that of the take's single precision, mostly."""


@dataclass(frozen=True)
class HeadMotion:
    """Rigid motion of the head: a captured frame is ``R_t x + t_t`` of the stabilised one.

    ``rotations`` (T, 3, 3), ``translations`` (T, 3) in the mesh's unit.
    """

    rotations: Array
    translations: Array

    @classmethod
    def none(cls, n_frames: int) -> HeadMotion:
        """No motion at all."""
        return cls(np.tile(np.eye(3), (n_frames, 1, 1)), np.zeros((n_frames, 3)))

    def seen_from(self, similarity: Similarity) -> HeadMotion:
        """The same motion on the other face: ``Q o (R, t) o Q^-1`` for ``Q`` from this face to the other.

        The translation is scaled by the size ratio of the two faces, since Q is.
        """
        s, q, c = similarity.scale, similarity.rotation, similarity.translation
        rotations = q @ self.rotations @ q.T
        translations = s * self.translations @ q.T + c - np.einsum("tij,j->ti", rotations, c)
        return HeadMotion(rotations, translations)


def fit_head_motion(
    sequence: FrameSequence, reference: Array, *, enabled: bool = True, progress: Progress = silent
) -> HeadMotion:
    """Head motion of a take against its reference ``(V, 3)``, on robustly chosen stable vertices."""
    if not enabled:
        return HeadMotion.none(sequence.n_frames)
    picks = np.unique(np.linspace(0, len(reference) - 1, min(_SAMPLE, len(reference))).astype(int))
    points = np.empty((sequence.n_frames, len(picks), 3))
    for start, stop in sequence.blocks():
        points[start:stop] = sequence.read(start, stop, picks)
        progress("finding the head's motion", stop, sequence.n_frames)
    rest = np.asarray(reference, dtype=np.float64)[picks]
    return rigid_fits(rest, points, stable_weights(rest, points))


def stable_weights(rest: Array, points: Array) -> Array:
    """Weights ``(n,)`` of the vertices by how little each strays from the common rigid motion over the take.

    Iteratively re-weighted with Geman-McClure's weight ``1 / (1 + (r / sigma)^2)^2``, ``r`` the vertex's RMS residual
    over all frames, ``sigma`` the residual of the quietest fifth. ``rest`` (n, 3), ``points`` (T, n, 3).
    """
    n, n_frames = len(rest), len(points)
    weights = np.ones(n)
    smallest = _ROUNDING * float(np.linalg.norm(np.ptp(rest, axis=0)))
    # About the middle, where rounding is least; vertex by vertex, so that all frames are one product of matrices.
    middle = rest.mean(axis=0)
    rest = rest - middle
    rows = (points - middle).transpose(1, 0, 2).reshape(n, -1)
    squares = np.einsum("ni,ni->n", rows, rows)
    for _ in range(_ROUNDS):
        length = np.sqrt(_squared_residuals(rest, rows, squares, _rigid_fits(rest, rows, weights)) / n_frames)
        sigma = max(float(np.quantile(length, _STABLE_SHARE)), smallest)
        weights = 1 / (1 + (length / sigma) ** 2) ** 2
    return weights


def _squared_residuals(rest: Array, rows: Array, squares: Array, motion: HeadMotion) -> Array:
    """``sum_t |R_t r_v + t_t - p_tv|^2`` (n,), multiplied out; ``squares`` (n,) are ``sum_t |p_tv|^2``."""
    turn, shift = motion.rotations.reshape(-1, 3), motion.translations.ravel()
    onto = rows @ np.column_stack([turn, shift])  # sum_t R_t^T p_tv and t_t . p_tv
    total = squares + len(motion.rotations) * np.einsum("ni,ni->n", rest, rest) + shift @ shift
    total += 2 * (rest @ (shift @ turn) - np.einsum("ni,ni->n", rest, onto[:, :3]) - onto[:, 3])
    return np.maximum(total, 0)


def rigid_fits(rest: Array, points: Array, weights: Array) -> HeadMotion:
    """Weighted Kabsch for every frame at once: ``argmin sum_v w_v |R_t rest_v + t_t - points_tv|^2``."""
    return _rigid_fits(rest, points.transpose(1, 0, 2).reshape(len(rest), -1), weights)


def _rigid_fits(rest: Array, rows: Array, weights: Array) -> HeadMotion:
    """As `rigid_fits`, from points ``(n, 3T)``."""
    share = weights / weights.sum()
    rest_mean = share @ rest
    # The weighted rest points sum to zero, so the frames need no centring.
    sums = (np.column_stack([rest - rest_mean, np.ones(len(rest))]) * share[:, None]).T @ rows
    covariance, means = sums[:3].reshape(3, -1, 3).transpose(1, 2, 0), sums[3].reshape(-1, 3)
    u, _, vt = np.linalg.svd(covariance)
    sign = np.linalg.det(u @ vt)
    u[:, :, 2] *= sign[:, None]
    rotations = u @ vt
    return HeadMotion(rotations, means - np.einsum("tij,j->ti", rotations, rest_mean))
