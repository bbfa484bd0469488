"""A region bent in the plane so that the wrinkle in it runs along another curve (the paper's Eq. 17)."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.detail_edit.flatten import FlatPatch, gradients, located
from toolkit.detail_edit.region import Region
from toolkit.solve import factorise

__all__ = ["bent_along"]

Complex = NDArray[np.complex128]
Ids = NDArray[np.int64]

_ROUNDS = 20
_LOOSE = 1e-6


def bent_along(flat: FlatPatch, region: Region, curve: Complex, goal: Complex, stiffness: float) -> Complex:
    """Where the patch's vertices ``(n,)`` go when ``curve`` (k,) goes to ``goal`` (j,), by share of the arc length.

    ``argmin_u sum_c |u(curve_c) - goal_c|^2 + stiffness sum_f area_f |grad u - R_f|^2``. Eq. 17 keeps the Laplacian
    coordinates, which do not turn with the region: bent into another arch it is squeezed together and folds over. Here
    every triangle may turn by its own R_f (as rigid as possible), found in turn with u, so that a wrinkle keeps its
    width. Only the triangles that the region touches are bent.
    """
    inside = np.isin(flat.vertices, region.vertices)
    middle = float(np.median(np.abs(flat.places[flat.triangles[:, 0]] - flat.places[flat.triangles[:, 1]])))
    count = max(int(np.ceil(2 * _length(curve) / middle)), 2)
    start, end = _spread(curve, count), _spread(goal, count)
    under, weights = located(flat.places, flat.triangles, start)
    touched = np.flatnonzero(inside[flat.triangles].any(axis=1))
    used = np.union1d(touched, under[under >= 0])
    kept, faces = np.unique(flat.triangles[used], return_inverse=True)
    faces = faces.reshape(-1, 3)
    number = np.cumsum(np.isin(np.arange(len(flat.vertices)), kept)) - 1
    seen = under >= 0
    rows = np.repeat(np.arange(int(seen.sum())), 3)
    columns = number[flat.triangles[under[seen]]].ravel()
    at_curve = sp.csr_matrix((weights[seen].ravel(), (rows, columns)), shape=(int(seen.sum()), len(kept)))
    bent = flat.places.copy()
    bent[kept] = _rigid_as_possible(flat.places[kept], faces, at_curve, start, end, end[seen], stiffness)
    return bent


def _rigid_as_possible(
    places: Complex, faces: Ids, at_curve: sp.csr_matrix, start: Complex, end: Complex, goals: Complex, stiffness: float
) -> Complex:
    corners = places[faces]
    sides = corners[:, 1:] - corners[:, :1]
    areas = np.abs((sides[:, 0].conj() * sides[:, 1]).imag) / 2
    along, across = gradients(sides, np.maximum(areas, 1e-12 * areas.max()), faces, len(places))
    weighted = sp.diags(stiffness * areas)
    # To begin with, everything goes along with the nearest point of the curve.
    turns: Complex = np.gradient(end) / np.gradient(start)
    turns = turns / np.maximum(np.abs(turns), 1e-300)
    first = _carried(places, start, end, turns)
    held = at_curve.T @ at_curve + _LOOSE * sp.identity(len(places))
    factor = factorise(sp.csc_matrix(along.T @ weighted @ along + across.T @ weighted @ across + held))
    pull = at_curve.T @ goals + _LOOSE * first
    moved = first
    for _ in range(_ROUNDS):
        similar = along @ moved - 1j * (across @ moved)
        turn = similar / np.maximum(np.abs(similar), 1e-300)
        right = pull + stiffness * (along.T @ (areas * turn) + across.T @ (areas * 1j * turn))
        solved = factor.solve(np.stack([right.real, right.imag], axis=1))
        moved = solved[:, 0] + 1j * solved[:, 1]
    return np.asarray(moved)


def _carried(places: Complex, start: Complex, end: Complex, turns: Complex) -> Complex:
    """Each place moved and turned with the point of the curve nearest to it."""
    nearest = np.argmin(np.abs(places[:, None] - start), axis=1)
    return np.asarray(end[nearest] + turns[nearest] * (places - start[nearest]))


def _spread(line: Complex, count: int) -> Complex:
    """Points ``(count,)`` evenly spread by arc length along a polyline."""
    at = np.concatenate([[0], np.cumsum(np.abs(np.diff(line)))])
    asked = np.linspace(0, at[-1], count)
    return np.asarray(np.interp(asked, at, line.real) + 1j * np.interp(asked, at, line.imag))


def _length(line: Complex) -> float:
    return float(np.abs(np.diff(line)).sum())
