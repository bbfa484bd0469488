"""A part of the surface laid flat, as true to its lengths as it goes: there a wrinkle is moved, turned and bent.

As-rigid-as-possible parametrisation (Liu et al. 2008): each triangle wants to keep its shape, the best rotations and
the best places are found in turn. Places in the plane are complex numbers, so a rotation is a product.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from toolkit.detail_edit.surface import Surface
from toolkit.mesh.geometry import face_normals
from toolkit.solve import factorise

__all__ = ["FlatPatch", "flattened", "gradients", "located", "minimal_turn"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Ids = NDArray[np.int64]

_ROUNDS = 12
_CANDIDATES = (6, 32)


@dataclass(frozen=True, eq=False)
class FlatPatch:
    """A part of a surface in the plane.

    ``vertices`` (n,) ids on the face, ascending; ``triangles`` (f, 3) in places of ``vertices``; ``places`` (n,)
    complex, 0 in the middle, real axis along the asked direction.
    """

    vertices: Ids
    triangles: Ids
    places: Complex

    def at(self, triangles: Ids, weights: Array, surface: Surface) -> Complex:
        """Places ``(k,)`` of surface points, given by triangle ids of the face and weights; nan where not in here."""
        corners = surface.triangles[triangles]
        found = np.minimum(np.searchsorted(self.vertices, corners), len(self.vertices) - 1)
        missing = (self.vertices[found] != corners).any(axis=1)
        places = np.einsum("nk,nk->n", weights, self.places[found])
        places[missing] = np.nan
        return np.asarray(places)


def flattened(surface: Surface, vertices: Ids, centre: Ids, weights: Array, axes: Array) -> FlatPatch | None:
    """Lay the triangles among ``vertices`` (n,) flat, those that hang together with the centre.

    ``centre`` (3,) the corners of the triangle that the point in the middle lies in and ``weights`` (3,) where in it;
    ``axes`` (3, 3) rows: direction of the real axis, of the imaginary one, and the normal there. None if the centre is
    not among the triangles.
    """
    triangles = surface.triangles[surface.triangles_within(vertices)]
    kept = _around(triangles, centre)
    if kept is None:
        return None
    ids, local = np.unique(triangles[kept], return_inverse=True)
    faces = local.reshape(-1, 3)
    points = surface.vertices[ids]
    sides, areas = _unfolded(points, faces)
    along, across = gradients(sides, areas, faces, len(ids))
    weighted = sp.diags(areas)
    stiffness = sp.csc_matrix(along.T @ weighted @ along + across.T @ weighted @ across)
    middle = np.searchsorted(ids, centre)
    pin = sp.csc_matrix((weights * areas.mean(), (middle, middle)), shape=stiffness.shape)
    factor = factorise(stiffness + pin)
    turns = _first_turns(points, faces, axes)
    start = turns.copy()
    places = np.zeros(len(ids), dtype=np.complex128)
    for _ in range(_ROUNDS):
        right = along.T @ (areas * turns) + across.T @ (areas * 1j * turns)
        solved = factor.solve(np.stack([right.real, right.imag], axis=1))
        places = solved[:, 0] + 1j * solved[:, 1]
        # The part of the map that is a rotation and a scale, its scale left out.
        similar = along @ places - 1j * (across @ places)
        turns = similar / np.maximum(np.abs(similar), 1e-300)
    near = np.isin(faces, middle).any(axis=1)
    drift = np.sum(turns[near] * start[near].conj())
    places *= drift.conj() / max(abs(drift), 1e-300)
    return FlatPatch(ids, faces, places - weights @ places[middle])


def located(places: Complex, triangles: Ids, queries: Complex) -> tuple[Ids, Array]:
    """For each query ``(q,)`` the triangle that it lies in, -1 if none does, and its weights there ``(q, 3)``.

    ``places`` (n,) and ``triangles`` (f, 3) may be a bent patch: triangles turned over are passed by.
    """
    found, weights = np.full(len(queries), -1, dtype=np.int64), np.zeros((len(queries), 3))
    if len(triangles) == 0:
        return found, weights
    a, b, c = (places[triangles[:, k]] for k in range(3))
    area = _cross(b - a, c - a)
    upright = np.flatnonzero(area > 1e-12 * np.abs(area).max())
    middle = (a + b + c)[upright] / 3
    tree = cKDTree(np.stack([middle.real, middle.imag], axis=1))
    # No point of a triangle is farther from its middle than its longest side is long.
    reach = float(np.abs(np.stack([b - a, c - b, a - c])[:, upright]).max())
    for candidates in _CANDIDATES:
        rows = np.flatnonzero(found < 0)
        count = min(candidates, len(upright))
        at = np.stack([queries[rows].real, queries[rows].imag], axis=1)
        distance, near = (np.reshape(x, (len(rows), count)) for x in tree.query(at, count, distance_upper_bound=reach))
        close = np.isfinite(distance[:, 0])
        rows, near = rows[close], upright[np.minimum(near[close], len(upright) - 1)]
        q = queries[rows, None]
        second = _cross(q - a[near], (c - a)[near]) / area[near]
        third = _cross((b - a)[near], q - a[near]) / area[near]
        each = np.stack([1 - second - third, second, third], axis=2)
        best = each.min(axis=2).argmax(axis=1)
        chosen, triangle = each[np.arange(len(rows)), best], near[np.arange(len(rows)), best]
        inside = chosen.min(axis=1) > -1e-6
        found[rows[inside]] = triangle[inside]
        weights[rows[inside]] = np.clip(chosen[inside], 0, 1)
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-300)
    return found, weights


def minimal_turn(start: Array, goal: Array) -> Array:
    """Smallest rotations ``(..., 3, 3)`` that take unit vectors ``start`` (..., 3) to ``goal`` (..., 3) (Rodrigues)."""
    start, goal = np.broadcast_arrays(start, goal)
    axis = np.cross(start, goal)
    cosine = np.sum(start * goal, axis=-1)[..., None, None]
    skew = np.zeros((*axis.shape, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        skew[..., j, i], skew[..., i, j] = axis[..., k], -axis[..., k]
    return np.asarray(np.eye(3) + skew + skew @ skew / np.maximum(1 + cosine, 1e-6))


def _around(triangles: Ids, centre: Ids) -> NDArray[np.bool_] | None:
    """Mask ``(f,)`` of the triangles that hang together by edges with the one whose corners are ``centre``."""
    middle = np.flatnonzero((np.sort(triangles, axis=1) == np.sort(centre)).all(axis=1))
    if len(middle) == 0:
        return None
    ends = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    order = np.lexsort(ends.T)
    same = np.flatnonzero((ends[order][1:] == ends[order][:-1]).all(axis=1))
    owner = np.tile(np.arange(len(triangles)), 3)[order]
    pairs = (np.ones(len(same)), (owner[same], owner[same + 1]))
    _, labels = connected_components(sp.coo_matrix(pairs, shape=(len(triangles),) * 2), directed=False)
    return np.asarray(labels == labels[middle[0]])


def _unfolded(points: Array, faces: Ids) -> tuple[Complex, Array]:
    """Two sides of each triangle in its own plane ``(f, 2)``, the first one real, and the areas ``(f,)``."""
    first, second = points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]]
    length = np.maximum(np.linalg.norm(first, axis=1), 1e-300)
    along = np.einsum("fi,fi->f", first, second) / length
    double = np.linalg.norm(np.cross(first, second), axis=1)
    double = np.maximum(double, 1e-9 * double.max(initial=0) + 1e-300)
    return np.stack([length + 0j, along + 1j * double / length], axis=1), double / 2


def gradients(sides: Complex, areas: Array, faces: Ids, n: int) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Derivatives ``(f, n)`` of a function on the vertices, along the real and the imaginary axis of each triangle.

    ``sides`` (f, 2) complex, its first and second side from the first corner; ``areas`` (f,).
    """
    opposite = np.stack([sides[:, 1] - sides[:, 0], -sides[:, 1], sides[:, 0]], axis=1)  # of corners 0, 1, 2
    slopes = 1j * opposite / (2 * areas[:, None])
    rows = np.repeat(np.arange(len(faces)), 3)
    shape = (len(faces), n)
    along = sp.csr_matrix((slopes.real.ravel(), (rows, faces.ravel())), shape=shape)
    return along, sp.csr_matrix((slopes.imag.ravel(), (rows, faces.ravel())), shape=shape)


def _first_turns(points: Array, faces: Ids, axes: Array) -> Complex:
    """Where each triangle's first side points in the plane once its normal is turned to the centre's, ``(f,)``."""
    normals = face_normals(points, faces)
    first = points[faces[:, 1]] - points[faces[:, 0]]
    flat = np.einsum("fij,fj->fi", minimal_turn(normals, axes[2]), first)
    turn = flat @ axes[0] + 1j * (flat @ axes[1])
    return np.asarray(turn / np.maximum(np.abs(turn), 1e-300))


def _cross(a: Complex, b: Complex) -> Array:
    return np.asarray((a.conj() * b).imag)
