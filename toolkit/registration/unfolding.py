"""Triangles that came out turned over, laid flat again with the source's own shape as the pattern."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh, vertex_adjacency, vertex_normals
from toolkit.registration.folds import agreement, backwards
from toolkit.registration.surface import Hits
from toolkit.rigid import umeyama
from toolkit.solve import factorise

__all__ = ["unfold"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_ROUNDS, _FIRST_RINGS = 6, 2
_TURNED = 0.1
"""Cosine to its neighbours' mean normal below which a triangle counts as turned over."""
_AGREES = 0.5
"""Cosine to the target's normal from which on a vertex that was laid lies on the right side of the surface."""


def unfold(source: TriangleMesh, points: Array, skin: Mask, closest: Callable[[Array], Hits]) -> Array:
    """Positions ``(V, 3)`` without triangles that are turned over, as far as that can be had.

    Round such triangles, two rings first and one more in each round that still finds some, the source's own patch is
    laid where the patch lies now (the best similarity), and its vertices take the displacements of the patch's border
    from there, filled in harmonically. The source has no folds, so neither has what is near to similar to it; the
    landmarks' spline, which can fold lids, has no part in it. What was laid so goes back to the surface where it can.

    Parameters
    ----------
    source : the source reference
    points : (V, 3) its vertices on the target
    skin : (V,) what may move
    closest : closest points of the target's surface to (V, 3)
    """
    adjacency = vertex_adjacency(source.triangles, len(points)).astype(bool).tocsr()
    triangles, outside, laid = source.triangles, closest(points).normals, points
    judged = skin[triangles].all(axis=1) & (agreement(source.vertices, triangles) > _TURNED)
    bad = judged & _turned(triangles, laid, outside)
    if not bad.any():
        return points
    # From here on only what lies round them is looked at.
    near = _around(triangles[bad], adjacency, _FIRST_RINGS + 2 * _ROUNDS)
    kept = near[triangles].any(axis=1)
    triangles, bad = triangles[kept], bad[kept]
    judged = judged[kept] & near[triangles].all(axis=1)
    loose = np.zeros(len(points), dtype=bool)
    for rings in range(_FIRST_RINGS, _FIRST_RINGS + _ROUNDS):
        if not bad.any():
            break
        wider = loose | (_around(triangles[bad], adjacency, rings) & skin)
        tried = _relaid(source.vertices, laid, adjacency, wider)
        left = judged & _turned(triangles, tried, outside)
        if np.count_nonzero(left) >= np.count_nonzero(bad):
            break
        loose, laid, bad = wider, tried, left
    return _landed(triangles, laid, loose, closest, adjacency, judged) if loose.any() else points


def _landed(
    triangles: NDArray[np.integer],
    laid: Array,
    loose: Mask,
    closest: Callable[[Array], Hits],
    adjacency: sp.csr_matrix,
    judged: Mask,
) -> Array:
    """Laid patches on the surface, but for where that folds them again."""
    hits = closest(laid)
    agree = np.einsum("nd,nd->n", vertex_normals(laid, triangles), hits.normals) > _AGREES
    down = loose & agree & ~hits.on_border
    before = judged & _turned(triangles, laid, hits.normals)
    for _ in range(_ROUNDS):
        landed = np.where(down[:, None], hits.points, laid)
        folded = judged & _turned(triangles, landed, hits.normals) & ~before
        if not folded.any():
            return landed
        down &= ~_around(triangles[folded], adjacency, 1)
    return laid


def _around(triangles: NDArray[np.integer], adjacency: sp.csr_matrix, rings: int) -> Mask:
    grown = np.zeros(adjacency.shape[0], dtype=bool)
    grown[triangles] = True
    for _ in range(rings):
        grown |= np.asarray(adjacency @ grown)
    return grown


def _turned(triangles: NDArray[np.integer], points: Array, outside: Array) -> Mask:
    """Mask ``(F,)``: against its neighbours, or with the back to the target's outside where that is sure."""
    return np.asarray((agreement(points, triangles) < _TURNED) | backwards(points, triangles, outside))


def _relaid(source: Array, points: Array, adjacency: sp.csr_matrix, loose: Mask) -> Array:
    ids = np.flatnonzero(loose)
    _, part = connected_components(adjacency[ids][:, ids], directed=False)
    laid = points.copy()
    for k in range(part.max(initial=-1) + 1):
        patch = ids[part == k]
        rows = adjacency[patch]
        border = np.setdiff1d(np.unique(rows.indices), patch)
        if len(border) < 3:
            continue
        near = np.concatenate([patch, border])
        try:
            pattern = umeyama(source[near], points[near])
        except InputError:  # a patch without extent in two directions
            continue
        degree = np.asarray(rows.sum(axis=1)).ravel().astype(float)
        matrix = sp.diags(degree * (1 + 1e-6)) - rows[:, patch].astype(float)
        shift = points[border] - pattern.apply(source[border])
        laid[patch] = pattern.apply(source[patch]) + factorise(sp.csc_matrix(matrix)).solve(
            rows[:, border].astype(float) @ shift
        )
    return laid
