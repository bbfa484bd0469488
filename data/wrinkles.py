"""Wrinkles that the skin's own compression brings out: authored lines, measured strain, a groove with its bulges."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from data.layout import hand_made
from toolkit.mesh import face_normals, triangle_areas

__all__ = ["WrinkleFamily", "mean_edge", "wrinkle_families"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_STEP = 0.03
"""Distance of the points on a line, cm."""
_REACH = 2.0
"""Radius over which the compression is averaged (a Gaussian's sigma), in widths of the family's lines."""
_MARGIN = 4.0
"""How far a groove with its bulges reaches, in widths."""


class WrinkleFamily:
    """Lines that fold together: ``height(vertices)`` is their relief on one frame.

    ``vertices`` (n,) are the ids it moves, ``carrier`` (n,) the relief there at full depth. The stretch across the
    lines of each triangle is ``|a e1 + b e2|`` with the triangle's deformed edges e1, e2 and fixed a, b: one unit
    vector across the line, expressed in the rest edges. Its shortfall from 1, averaged over the neighbourhood, brings
    a line from nothing (``onset``) to its whole depth (``full``).
    """

    def __init__(self, name: str, given: dict[str, Any], lines: list[Array], skin: Skin) -> None:
        self.name = name
        self.onset, self.full = given["onset"], given["full"]
        reach = _MARGIN * given["width"]
        self.vertices = skin.within(lines, reach)
        points, edge = skin.rest[self.vertices], skin.edge[self.vertices]
        grooves = [_groove(points, line, given, edge, k) for k, line in enumerate(lines)]
        self.carrier: Array = np.sum(grooves, axis=0)
        blur = _REACH * given["width"]
        self._corners = skin.coarse[skin.coarse_within(lines, reach + 2 * blur)]
        self._across = _across(skin.rest, self._corners, lines)
        self._gather = _gather(skin.rest, self.vertices, self._corners, blur)

    def compression(self, vertices: Array) -> Array:
        """Share by which the skin is shorter across the lines than at rest, at ``self.vertices``."""
        a, b, c = (vertices[self._corners[:, k]] for k in range(3))
        carried = self._across[:, :1] * (b - a) + self._across[:, 1:] * (c - a)
        return np.asarray(self._gather @ (1 - np.linalg.norm(carried, axis=1)))

    def height(self, vertices: Array) -> Array:
        """Relief along the normals at ``self.vertices``, cm, of the smooth frame ``vertices`` (V, 3)."""
        active = np.clip((self.compression(vertices) - self.onset) / (self.full - self.onset), 0, 1)
        return active**2 * (3 - 2 * active) * self.carrier


class Skin:
    """The performer's outer skin at rest, and its chart: a cylinder round the head, arc length and height."""

    def __init__(
        self, rest: Array, triangles: NDArray[np.integer], coarse: NDArray[np.integer], chart: dict[str, Any]
    ) -> None:
        self.rest, self.triangles = rest, np.asarray(triangles, dtype=np.int64)
        self.coarse = np.asarray(coarse, dtype=np.int64)
        self.edge = mean_edge(rest, self.triangles)
        self._centres = rest[self.coarse].mean(axis=1)
        used = np.unique(self.triangles)
        used = used[rest[used, 2] > chart["axis_z"]]
        self.used = used
        shown = np.intersect1d(used, self.coarse)
        arc = chart["radius"] * np.arctan2(rest[shown, 0], rest[shown, 2] - chart["axis_z"])
        self._chart, self._lifted = np.column_stack([arc, rest[shown, 1]]), rest[shown]

    def line(self, points: list[list[float]], seed: int) -> Array:
        """Points ``(n, 3)`` on the skin of a curve through chart points, slightly wavy as skin is."""
        knots = np.array(points)
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
        at = np.linspace(0, along[-1], max(8, int(along[-1] / _STEP)))
        curve = CubicSpline(along, knots)(at)
        rng = np.random.default_rng(seed)
        for length in (1.9, 0.8):
            wave = 0.016 * length * np.sin(2 * np.pi * (at / length + rng.random()))
            curve[:, np.argmin(np.ptp(knots, axis=0))] += wave
        return self._on_skin(curve)

    def _on_skin(self, curve: Array) -> Array:
        """Lift chart points ``(n, 2)`` to the skin: the affine map that fits the eight nearest vertices best."""
        near = np.asarray(cKDTree(self._chart).query(curve, k=8)[1])
        flat, solid = self._chart[near] - curve[:, None], self._lifted[near]
        terms = np.concatenate([np.ones((*near.shape, 1)), flat], axis=2)
        gram = np.swapaxes(terms, 1, 2) @ terms + 1e-9 * np.eye(3)
        return np.asarray(np.linalg.solve(gram, np.swapaxes(terms, 1, 2) @ solid)[:, 0])

    def within(self, lines: list[Array], reach: float) -> Index:
        distance = cKDTree(np.concatenate(lines)).query(self.rest[self.used])[0]
        return self.used[np.asarray(distance) < reach]

    def coarse_within(self, lines: list[Array], reach: float) -> Index:
        distance = cKDTree(np.concatenate(lines)).query(self._centres)[0]
        return np.flatnonzero(np.asarray(distance) < reach)


def wrinkle_families(rest: Array, triangles: NDArray[np.integer], coarse: NDArray[np.integer]) -> list[WrinkleFamily]:
    """All families of ``samples/wrinkles.json`` on the skin ``triangles`` of the performer at ``rest`` (V, 3), cm.

    ``coarse`` are the skin's triangles one round of subdivision before, on the same vertices: strain is measured there.
    """
    given = hand_made("wrinkles")
    skin = Skin(rest, triangles, coarse, given)
    families = []
    for order, (name, family) in enumerate(given["families"].items()):
        sides = (1.0, -1.0) if family["mirror"] else (1.0,)
        for side in sides:
            lines = [
                skin.line([[side * s, y] for s, y in line], 100 * order + 10 * k + int(side < 0))
                for k, line in enumerate(family["lines"])
            ]
            families.append(WrinkleFamily(name, family, lines, skin))
    return families


def mean_edge(vertices: Array, triangles: NDArray[np.integer]) -> Array:
    """Size of the mesh round each vertex ``(V,)``: the root of twice the mean area of its triangles."""
    area = np.repeat(2 * triangle_areas(vertices, triangles), 3)
    corners = np.asarray(triangles).ravel()
    total = np.bincount(corners, weights=area, minlength=len(vertices))
    return np.asarray(np.sqrt(total / np.maximum(np.bincount(corners, minlength=len(vertices)), 1)))


def _groove(points: Array, line: Array, given: dict[str, Any], edge: Array, seed: int) -> Array:
    """Relief of one whole-depth line: a groove between two bulges (a Ricker profile), tapered and uneven along it.

    The profile is never narrower than the mesh can show; where it would have to be far wider, it fades.
    """
    distance, nearest = cKDTree(line).query(points)
    along = np.asarray(nearest) / (len(line) - 1)
    width = np.maximum(given["width"], 0.75 * edge)
    shown = np.exp(-(np.maximum(width / given["width"] - 1.6, 0) ** 2) / 0.2)
    rng = np.random.default_rng(1000 + seed)
    uneven = 0.85 + 0.15 * np.sin(2 * np.pi * (2.3 * along + rng.random())) * np.sin(2 * np.pi * (0.9 * along))
    taper = np.clip(np.minimum(along, 1 - along) / 0.3, 0, 1)
    ratio = (np.asarray(distance) / (width * (0.75 + 0.25 * taper))) ** 2
    profile = -(1 - ratio) * np.exp(-ratio / 2)
    return np.asarray(given["depth"] * shown * uneven * taper**2 * (3 - 2 * taper) * profile)


def _across(rest: Array, corners: Index, lines: list[Array]) -> Array:
    """Coefficients ``(n, 2)`` of the unit vector across the nearest line, in each triangle's two edges."""
    points = np.concatenate(lines)
    tangents = np.concatenate([np.gradient(line, axis=0) for line in lines])
    a, b, c = (rest[corners[:, k]] for k in range(3))
    tangent = tangents[np.asarray(cKDTree(points).query((a + b + c) / 3)[1])]
    across = np.cross(face_normals(rest, corners), tangent)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    edges = np.stack([b - a, c - a], axis=2)
    gram = np.swapaxes(edges, 1, 2) @ edges
    return np.asarray(np.linalg.solve(gram, np.swapaxes(edges, 1, 2) @ across[:, :, None])[:, :, 0])


def _gather(rest: Array, vertices: Index, corners: Index, blur: float) -> sp.csr_matrix:
    """Matrix ``(n vertices, n triangles)``: Gaussian mean over the neighbourhood, by area."""
    centres, areas = rest[corners].mean(axis=1), triangle_areas(rest, corners)
    pairs = cKDTree(rest[vertices]).sparse_distance_matrix(cKDTree(centres), 2 * blur, output_type="coo_matrix")
    weight = np.exp(-0.5 * (pairs.data / blur) ** 2) * areas[pairs.col]
    matrix = sp.csr_matrix((weight, (pairs.row, pairs.col)), shape=(len(vertices), len(corners)))
    matrix.sort_indices()
    total = np.maximum(np.asarray(matrix.sum(1)).ravel(), 1e-12)
    return sp.csr_matrix(sp.diags(1 / total) @ matrix)
