"""Whether landmark pairs can be believed: ids, mirror images, and pairs that contradict the others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from toolkit.checks.picks import ADVISED_LANDMARKS, NEEDED_LANDMARKS
from toolkit.errors import InputError, RegistrationError
from toolkit.registration.landmarks import Landmarks
from toolkit.registration.spline import ThinPlateSpline
from toolkit.rigid import umeyama

__all__ = ["check_landmarks", "extent", "misfit"]

Array = NDArray[np.float64]

_MIRROR = 0.7
"""A mirrored fit with less than this share of the plain fit's residual means that left and right are exchanged."""
_REFUSED, _DOUBTED = 1.6, 1.0
"""How far the spline through the other pairs may miss a pair, as a share of its distance to the nearest landmarks.
Correct sets reach 0.2 to 0.5 between humans and 1.2 between a human and a dog; two exchanged pairs give 1.9 and more,
one pair misplaced by a fifth of the face 0.7 to 5."""


def check_landmarks(landmarks: Landmarks, source: Array, target: Array, *, where: object = "landmarks") -> list[str]:
    """Refuse landmarks that cannot be right, and return sentences about those that may do harm.

    Parameters
    ----------
    landmarks : the pairs
    source, target : (V, 3) and (V', 3) vertices of the two meshes
    where : the file they come from, for the messages

    Raises
    ------
    InputError : ids out of range, a vertex or a name used twice, fewer than 8 pairs, all in one plane
    RegistrationError : left and right exchanged, or pairs that contradict the others; the worst are named
    """
    _check_ids(landmarks, len(source), len(target), where)
    if len(landmarks) < NEEDED_LANDMARKS:
        raise InputError(
            f"{len(landmarks)} landmark pairs are too few",
            where=where,
            remedy=f"pick {NEEDED_LANDMARKS} at least, better 40",
        )
    p, q = source[landmarks.source], target[landmarks.target]
    for side, points in (("source", p), ("target", q)):
        _check_spread(points, side, where)
    _check_mirror(p, q, where)
    doubts = _contradictions(landmarks.names, p, q, where)
    if len(landmarks) < ADVISED_LANDMARKS:
        doubts.append(
            f"only {len(landmarks)} landmark pairs; {ADVISED_LANDMARKS} to 50 give a much closer correspondence"
        )
    return doubts


def misfit(p: Array, q: Array) -> float:
    """RMS residual of the best similarity from ``p`` to ``q`` (N, 3), as a share of the extent of ``q``."""
    gaps = umeyama(p, q).apply(p) - q
    return float(np.sqrt(np.mean(np.sum(gaps**2, axis=1)))) / extent(q)


def _check_ids(landmarks: Landmarks, n_source: int, n_target: int, where: object) -> None:
    for side, ids, n in (("source", landmarks.source, n_source), ("target", landmarks.target, n_target)):
        bad = np.flatnonzero((ids < 0) | (ids >= n))
        if len(bad):
            k = bad[0]
            raise InputError(
                f"{landmarks.names[k]!r} names {side} vertex {ids[k]}, but the {side} has {n} vertices (0 to {n - 1})",
                where=where,
                remedy="check that the landmarks belong to this mesh, and that ids start at 0",
            )
        values, counts = np.unique(ids, return_counts=True)
        if np.any(counts > 1):
            value = values[counts > 1][0]
            names = [landmarks.names[i] for i in np.flatnonzero(ids == value)]
            raise InputError(
                f"{side} vertex {value} is used by {len(names)} landmarks ({', '.join(map(repr, names))})",
                where=where,
                remedy="keep one of them",
            )


def _check_spread(points: Array, side: str, where: object) -> None:
    singular = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if singular[2] < 1e-3 * singular[0]:
        raise InputError(
            f"the {side} landmarks lie in one plane, so they fix no depth",
            where=where,
            remedy="add the nose tip, the chin and the jaw's corners",
        )


def _check_mirror(p: Array, q: Array, where: object) -> None:
    plain, mirrored = (misfit(side, q) for side in (p, p * [-1.0, 1.0, 1.0]))
    if mirrored < _MIRROR * plain:
        raise RegistrationError(
            f"the landmarks fit the mirrored face better (residual {mirrored:.1%} of their extent, not {plain:.1%})",
            where=where,
            remedy="left and right are exchanged on one of the faces: left is the character's own left on both",
        )


def _contradictions(names: tuple[str, ...], p: Array, q: Array, where: object) -> list[str]:
    """Take out the pair that fits the others least, while one stands out; refuse if any did."""
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
        raise _contradiction(names, p, q, keep, out, where)
    return doubts


def _contradiction(
    names: tuple[str, ...], p: Array, q: Array, keep: NDArray[np.integer], out: list[int], where: object
) -> RegistrationError:
    spline = ThinPlateSpline(p[keep], q[keep])
    gaps = np.linalg.norm(spline(p[out])[:, None] - q[out][None], axis=2)  # (from, to)
    for i in range(len(out)):
        for j in range(i + 1, len(out)):
            if gaps[i, j] + gaps[j, i] < 0.4 * (gaps[i, i] + gaps[j, j]):
                what = f"{names[out[i]]!r} and {names[out[j]]!r} are exchanged on one of the faces"
                return RegistrationError(what, where=where, remedy="exchange their vertices on one face")
    told = ", ".join(f"{names[k]!r} {gaps[i, i] / extent(q):.0%}" for i, k in enumerate(out[:3]))
    what = f"landmarks contradict each other: from where the others put them, by the face's extent, are {told}"
    return RegistrationError(what, where=where, remedy="look at these pairs on both faces; move or delete them")


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
