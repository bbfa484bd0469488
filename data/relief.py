"""The skin's relief at rest: pores, a little unevenness, faint lines where the face folds, and the lips' furrows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from data.layout import Layout
from data.wrinkles import WrinkleFamily, mean_edge
from toolkit.mesh import vertex_adjacency

__all__ = ["static_relief"]

Array = NDArray[np.float64]

_SEED = 7
_PORE_DEPTH = 0.014
_PORE_SPACING = 0.17
"""Smallest distance of two pores, cm; where the mesh is coarser, 2.1 of its edges."""
_UNEVEN = 0.007
_REST_LINES = 0.13
"""Share of a wrinkle's whole depth that is always there."""
_LIP_DEPTH = 0.007
_LIP_WAVE = 0.22
_LIP_RINGS = (2, 8)


def static_relief(
    layout: Layout, rest: Array, triangles: NDArray[np.integer], families: list[WrinkleFamily], level: int
) -> Array:
    """Height ``(V,)`` along the normals, cm, of the performer's skin ``triangles`` at ``rest`` (V, 3)."""
    rng = np.random.default_rng(_SEED)
    edge = mean_edge(rest, triangles)
    face = _face_mask(layout, rest, triangles, level)
    relief = face * (_pores(rest, triangles, edge, rng) + _uneven(triangles, edge, rng))
    relief = relief + _lips(layout, rest, level)
    for family in families:
        relief[family.vertices] += _REST_LINES * family.carrier
    return np.asarray(relief)


def _face_mask(layout: Layout, rest: Array, triangles: NDArray[np.integer], level: int) -> Array:
    """1 on the face, fading to 0 at the ears, the neck and the borders of lips, lids and nostrils."""
    n = len(rest)
    loops = ("eyelid_rim_left", "eyelid_rim_right", "lip_outer", "lip_inner", "nostril_rim_left", "nostril_rim_right")
    rims = np.concatenate([layout.loop(name, level) for name in loops])
    mask = np.zeros(n)
    skin = np.unique(triangles)
    away = np.asarray(cKDTree(rest[rims]).query(rest[skin])[0])
    mask[skin] = np.clip((away - 0.1) / 0.5, 0, 1)
    lip = np.unique(_lip_vertices(layout, rest, level))
    mask[lip] = 0
    return mask * np.clip((rest[:, 2] + 6.0) / 3.0, 0, 1) * np.clip((rest[:, 1] + 13.5) / 2.0, 0, 1)


def _pores(rest: Array, triangles: NDArray[np.integer], edge: Array, rng: np.random.Generator) -> Array:
    """Dimples at blue-noise places, each a little different in depth."""
    skin = np.unique(triangles)
    points = rest[skin]
    spacing = np.maximum(_PORE_SPACING, 2.1 * edge[skin])
    tree = cKDTree(points)
    near = tree.query_ball_point(points, spacing)
    free = np.ones(len(skin), dtype=bool)
    chosen = []
    for k in rng.permutation(len(skin)):
        if free[k]:
            chosen.append(k)
            free[near[k]] = False
    relief = np.zeros(len(rest))
    depth = _PORE_DEPTH * (0.5 + rng.random(len(chosen)))
    sigma = 0.36 * spacing[chosen]
    for k, deep, wide, around in zip(
        chosen, depth, sigma, tree.query_ball_point(points[chosen], 3 * sigma), strict=True
    ):
        square = np.sum((points[around] - points[k]) ** 2, axis=1)
        relief[skin[around]] -= deep * np.exp(-0.5 * square / wide**2)
    return relief


def _uneven(triangles: NDArray[np.integer], edge: Array, rng: np.random.Generator) -> Array:
    """Broad random unevenness: noise smoothed over some edges, its deviation in proportion to how broad it is."""
    neighbours = vertex_adjacency(triangles, len(edge))
    valence = np.maximum(np.asarray(neighbours.sum(1)).ravel(), 1)
    noise = rng.standard_normal(len(edge))
    for _ in range(6):
        noise = 0.5 * noise + 0.5 * (neighbours @ noise) / valence
    return np.asarray(_UNEVEN * np.clip(edge / 0.22, 0, 1) * noise / noise.std())


def _lips(layout: Layout, rest: Array, level: int) -> Array:
    """Furrows down the red of the lips: waves along the mouth, warped so that no two are alike."""
    relief = np.zeros(len(rest))
    lip = _lip_vertices(layout, rest, level)
    x = rest[lip, 0]
    phase = x / _LIP_WAVE + 0.35 * np.sin(2.1 * x + 0.4) + 0.25 * np.sin(5.3 * x)
    outer = rest[layout.loop("lip_outer", level)]
    inner = rest[layout.loop("lip_inner", level)]
    to_outer, to_inner = (np.asarray(cKDTree(loop).query(rest[lip])[0]) for loop in (outer, inner))
    red = np.clip(np.minimum(to_outer, to_inner + 0.1) / 0.25, 0, 1) * np.clip((2.2 - np.abs(x)) / 0.6, 0, 1)
    relief[lip] = -_LIP_DEPTH * red * np.maximum(np.cos(2 * np.pi * phase), -0.3)
    return relief


def _lip_vertices(layout: Layout, rest: Array, level: int) -> NDArray[np.int64]:
    """Vertices on the red of the lips: those of the faces between the outer and the inner lip line."""
    rings = layout.rings["mouth"][_LIP_RINGS[0] : _LIP_RINGS[1]]
    among = {vertex for ring in rings for vertex in ring}
    red = np.array([set(quad) <= among for quad in layout.quads(0).tolist()])
    return np.unique(layout.quads(level)[np.repeat(red, 4**level)])
