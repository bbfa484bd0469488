"""Whether landmark pairs can be believed: those that contradict the others are found and named."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from toolkit.checks.picks import NEEDED_LANDMARKS
from toolkit.errors import RegistrationError
from toolkit.registration.landmarks import Landmarks
from toolkit.registration.spline import ThinPlateSpline
from toolkit.rigid import umeyama

__all__ = ["extent", "misfit", "refuse_contradictions"]

Array = NDArray[np.float64]

_REFUSED, _DOUBTED = 1.6, 1.0
"""How far the spline through the other pairs may miss a pair, as a share of its distance to the nearest landmarks.
Correct sets reach 0.2 to 0.5 between humans and 1.2 between a human and a dog; two exchanged pairs give 1.9 and more,
one pair misplaced by a fifth of the face 0.7 to 5."""


def refuse_contradictions(landmarks: Landmarks, source: Array, target: Array) -> list[str]:
    """Refuse landmarks that contradict each other, and return sentences about those that may do harm.

    The pair that fits the others least is taken out, while one stands out.

    Parameters
    ----------
    landmarks : pairs that `toolkit.checks.check_landmarks` finds no fault with
    source, target : (V, 3) and (V', 3) vertices of the two meshes

    Raises
    ------
    RegistrationError : pairs that contradict the others; the worst are named
    """
    names, p, q = landmarks.names, source[landmarks.source], target[landmarks.target]
    keep = np.arange(len(p))
    out: list[int] = []
    doubts: list[str] = []
    while len(keep) > max(NEEDED_LANDMARKS - 2, len(p) // 2):
        share, gap = _missed(p[keep], q[keep])
        # Once one is out, those that go with it (the other of two exchanged) are looked for more closely.
        if share.max() < (_DOUBTED if out else _REFUSED):
            doubts = [
                f"landmark {names[keep[k]]!r} is {gap[k]:.0%} of the face's extent from where the others put it"
                for k in np.flatnonzero(share > _DOUBTED)
            ]
            break
        out.append(int(keep[_culprit(p[keep], q[keep], share)]))
        keep = np.setdiff1d(keep, out)
    if out:
        raise _contradiction(names, p, q, keep, out)
    return doubts


def misfit(p: Array, q: Array) -> float:
    """RMS residual of the best similarity from ``p`` to ``q`` (N, 3), as a share of the extent of ``q``."""
    gaps = umeyama(p, q).apply(p) - q
    return float(np.sqrt(np.mean(np.sum(gaps**2, axis=1)))) / extent(q)


def _contradiction(
    names: tuple[str, ...], p: Array, q: Array, keep: NDArray[np.integer], out: list[int]
) -> RegistrationError:
    spline = ThinPlateSpline(p[keep], q[keep])
    gaps = np.linalg.norm(spline(p[out])[:, None] - q[out][None], axis=2)  # (from, to)
    for i in range(len(out)):
        for j in range(i + 1, len(out)):
            if gaps[i, j] + gaps[j, i] < 0.4 * (gaps[i, i] + gaps[j, j]):
                what = f"{names[out[i]]!r} and {names[out[j]]!r} are exchanged on one of the faces"
                return RegistrationError(what, where="landmarks", remedy="exchange their vertices on one face")
    told = ", ".join(f"{names[k]!r} {gaps[i, i] / extent(q):.0%}" for i, k in enumerate(out[:3]))
    what = f"landmarks contradict each other: from where the others put them, by the face's extent, are {told}"
    return RegistrationError(what, where="landmarks", remedy="look at these pairs on both faces; move or delete them")


def _missed(p: Array, q: Array) -> tuple[Array, Array]:
    """How far the spline through all other pairs misses each ``(N,)``.

    First as a share of the distance to its neighbours, then of the extent.
    """
    posed = umeyama(p, q).apply(p)
    miss = np.linalg.norm(ThinPlateSpline(posed, q).leave_one_out(), axis=1)
    near = np.sort(cdist(posed, posed), axis=1)[:, 1:4].mean(axis=1)
    return miss / near, miss / extent(q)


def _culprit(p: Array, q: Array, share: Array) -> int:
    """Of the five worst, the one without which the rest agree: a misplaced pair spoils its neighbours too."""
    suspects = np.argsort(share)[::-1][:5]
    rest = [np.sort(_missed(np.delete(p, k, axis=0), np.delete(q, k, axis=0))[0])[-4:].sum() for k in suspects]
    return int(suspects[int(np.argmin(rest))])


def extent(points: Array) -> float:
    """Diagonal of the box round points ``(N, 3)`` along their principal axes: it does not change as they turn."""
    centred = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    return float(np.linalg.norm(np.ptp(centred @ axes, axis=0)))
