"""Feature lines that both faces have, as pairs of curves corner to corner, and the sheets that they part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from toolkit.feature_lines import FeatureLine, corners_of, find_openings, halves, shortest_edge_path, trace_lines
from toolkit.mesh import TriangleMesh, edge_graph, unique_edges

__all__ = [
    "Curve",
    "loops_of",
    "match_lines",
    "opposite_sheets",
    "sheet_labels",
    "source_rims",
    "voted_labels",
]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

_STEADY = 1.5
"""A vertex belongs to a sheet when the other sheet's rim is this much farther along the surface."""
_REACH = 0.5
"""How far a sheet reaches from its rim, in widths of the opening."""
_FAIRINGS = 3
"""Passes that take the zigzag out of a path along edges."""


@dataclass(frozen=True)
class Curve:
    """A line on the source, ``vertices`` (n,), and where it lies on the target, ``points`` (m, 3) in order.

    ``path`` (m,) are the target's vertices under the points; the points are faired, so that a path that zigzags
    along edges does not make the source's line zigzag. ``opening`` names the opening whose side it is, and ``side``
    is +1 (upper) or -1; 0 if it is not the rim of an opening.
    """

    name: str
    vertices: Ids
    points: Array
    path: Ids
    opening: str
    side: int


def match_lines(lines: Sequence[FeatureLine], source: TriangleMesh, target: TriangleMesh, posed: Array) -> list[Curve]:
    """Pair the lines that carry both sides.

    ``posed`` (V, 3) is the source where the landmarks' spline puts it, which tells where on a closed target line the
    corners are and which way round it runs. Closed lines whose vertices open ones cover are left out; other closed
    ones are split at their corners, the two vertices farthest apart.
    """
    both = trace_lines([line for line in lines if line.target_vertices is not None], source.vertices, source.triangles)
    rims = {frozenset(o.upper.tolist()): (o.name, 1) for o in find_openings(both, source.vertices)}
    rims |= {frozenset(o.lower.tolist()): (o.name, -1) for o in find_openings(both, source.vertices)}
    covered = {int(v) for line in both if not line.closed for v in line.vertices}
    curves = []
    for line in both:
        if line.target_vertices is None:
            continue
        path = shortest_edge_path(target.vertices, target.triangles, line.target_vertices, line.closed)
        if not line.closed:
            pieces = [(line.vertices, _along(path, posed[line.vertices], target.vertices))]
        elif len(covered.intersection(line.vertices.tolist())) > 2:
            continue
        else:
            pieces = _split(line.vertices, path, posed, target.vertices)
        for k, (ids, over) in enumerate(pieces):
            opening, side = rims.get(frozenset(ids.tolist()), ("", 0))
            name = line.name if len(pieces) == 1 else f"{line.name} {k + 1}"
            curves.append(Curve(name, ids, _faired(target.vertices[over]), over, opening, side))
    return curves


def source_rims(lines: Sequence[FeatureLine], source: TriangleMesh) -> list[Curve]:
    """Both sides of every opening that the source's lines draw, with or without a partner on the target."""
    nowhere = (np.empty((0, 3)), np.empty(0, dtype=np.int64))
    rims = []
    for opening in find_openings(trace_lines(lines, source.vertices, source.triangles), source.vertices):
        rims.append(Curve(f"{opening.name} upper", opening.upper, *nowhere, opening.name, 1))
        rims.append(Curve(f"{opening.name} lower", opening.lower, *nowhere, opening.name, -1))
    return rims


def loops_of(curves: Sequence[Curve], on_target: bool = False) -> list[Ids]:
    """Vertices of the rim of each opening among the curves, on the source or on the target."""
    names = sorted({c.opening for c in curves if c.opening})
    return [
        np.concatenate([c.path if on_target else c.vertices for c in curves if c.opening == name]) for name in names
    ]


def sheet_labels(
    mesh: TriangleMesh, skin: NDArray[np.bool_], curves: Sequence[Curve], on_target: bool
) -> dict[str, NDArray[np.int8]]:
    """For each opening with both sides, ``(V,)`` +1 on the upper sheet, -1 on the lower, 0 where it is not clear.

    Nearness is along the skin: lips that touch are far apart, and beyond the corners both rims are equally far.
    """
    labels = {}
    for name in sorted({c.opening for c in curves if c.opening}):
        sides = {c.side: (c.path if on_target else c.vertices) for c in curves if c.opening == name}
        if set(sides) == {1, -1}:
            width = float(np.linalg.norm(mesh.vertices[sides[1][0]] - mesh.vertices[sides[1][-1]]))
            labels[name] = _nearer(mesh, skin, sides[1][1:-1], sides[-1][1:-1], _REACH * width)
    return labels


def voted_labels(mesh: TriangleMesh, skin: NDArray[np.bool_], upper: Ids, lower: Ids, width: float) -> NDArray[np.int8]:
    """Sheets ``(V,)`` of a target without lines, from vertices ``upper`` and ``lower`` that surely lie on them.

    Such are found beside the rims, where one lip cannot be taken for the other; from there the surface itself leads
    to the edge of each lip and no farther, as it turns inwards there.
    """
    if not len(upper) or not len(lower):
        return np.zeros(mesh.n_vertices, dtype=np.int8)
    return _nearer(mesh, skin, upper, lower, _REACH * width)


def _nearer(mesh: TriangleMesh, skin: NDArray[np.bool_], upper: Ids, lower: Ids, reach: float) -> NDArray[np.int8]:
    edges = unique_edges(mesh.triangles)
    edges = edges[skin[edges].all(axis=1)]
    graph = edge_graph(mesh.vertices, edges)
    above, below = (dijkstra(graph, indices=ids, limit=_STEADY * reach, min_only=True) for ids in (upper, lower))
    near = np.minimum(above, below) < reach
    sides = np.where(above * _STEADY < below, 1, np.where(below * _STEADY < above, -1, 0))
    return np.where(near, sides, 0).astype(np.int8)


def opposite_sheets(triangles: NDArray[np.integer], labels: NDArray[np.int8], side: int) -> NDArray[np.bool_]:
    """Mask ``(F,)`` of the triangles that lie wholly on the other sheet than ``side``."""
    return np.all(labels[triangles] == -side, axis=1)


def _along(path: Ids, posed: Array, vertices: Array) -> Ids:
    """The path, turned round if it runs against the source's line."""
    ends = vertices[path[[0, -1]]]
    straight = np.linalg.norm(ends - posed[[0, -1]], axis=1).sum()
    crossed = np.linalg.norm(ends[::-1] - posed[[0, -1]], axis=1).sum()
    return path if straight <= crossed else path[::-1]


def _split(ids: Ids, path: Ids, posed: Array, vertices: Array) -> list[tuple[Ids, Ids]]:
    first, last = corners_of(posed[ids])
    corners = [int(np.argmin(np.linalg.norm(vertices[path] - posed[ids[k]], axis=1))) for k in (first, last)]
    if corners[0] == corners[1]:
        return []
    sides, over = halves(ids, first, last), halves(path, corners[0], corners[1])
    middle = posed[sides[0]].mean(axis=0)
    if np.linalg.norm(vertices[over[1]].mean(axis=0) - middle) < np.linalg.norm(
        vertices[over[0]].mean(axis=0) - middle
    ):
        over = over[::-1]
    return list(zip(sides, over, strict=True))


def _faired(points: Array) -> Array:
    """Take the zigzag of edge paths out of a polyline ``(m, 3)``; its ends stay."""
    smooth = points.copy()
    for _ in range(_FAIRINGS):
        smooth[1:-1] = 0.5 * smooth[1:-1] + 0.25 * (smooth[:-2] + smooth[2:])
    return smooth
