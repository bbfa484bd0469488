"""Another topology for a head: graded isotropic re-meshing that knows where each new vertex lies on the old surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from toolkit.mesh.topology import boundary_vertices, directed_edges, unique_edges, vertex_adjacency

__all__ = ["Density", "Hole", "Remesh", "border_loops", "closest_on_surface", "remesh", "split_quads"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_ITERATIONS = 3
_RELAXATIONS = 2
_OVERLAP = 0.1
"""How far, in cm, a coarser region reaches into a finer one: else the seam keeps the old mesh's short edges."""


@dataclass(frozen=True)
class Density:
    """Triangles of edge ``length`` where a vertex of some area is within the area's reach.

    ``areas`` are pairs (reach, vertex ids); without any, all of the mesh.
    """

    length: float
    areas: tuple[tuple[float, tuple[int, ...]], ...] = ()


@dataclass(frozen=True)
class Hole:
    """A cavity behind a rim: an eye socket or the mouth.

    ``upper`` and ``lower`` are the rim's arcs, both from the same corner to the other, edge paths on the old mesh;
    ``quads`` the old mesh's faces behind the rim, ``inner_quads`` the same region in the faces it shall keep.
    """

    name: str
    upper: list[int]
    lower: list[int]
    quads: Index
    inner_quads: Index


@dataclass(frozen=True)
class Remesh:
    """``triangles`` (F, 3) of the new mesh; ``places`` (V', V) barycentric rows: ``places @ old`` are its vertices.

    ``lines`` are edge paths on the new mesh, name to vertex ids, whose vertices lie on the old mesh's lines.
    """

    triangles: NDArray[np.int32]
    places: sp.csr_matrix
    lines: dict[str, list[int]]


def split_quads(quads: NDArray[np.integer]) -> NDArray[np.int32]:
    """Triangles ``(2F, 3)`` of quads: fans from the first corner, the toolkit's way."""
    return np.ascontiguousarray(quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3), dtype=np.int32)


def remesh(
    vertices: Array,
    quads: Index,
    holes: list[Hole],
    densities: list[Density],
    lines: dict[str, list[int]],
) -> Remesh:
    """Re-mesh a head, finer by region, with edges along ``lines`` and the holes' rims.

    Only the outer skin is re-meshed, cut open along the rims, so that lids and lips stay sharp; what is behind the
    rims keeps its faces and is sewn on. Every region is re-meshed once and from the old surface itself, for a coarse
    mesh that is refined later cannot find its way back into a fold: ``densities`` go from the finest, each with all
    that the finer ones leave. Give it a pose in which the lips are apart, closest points must not find the other
    sheet, and in which no skin is folded away. ``vertices`` (V, 3), ``quads`` (F, 4) of the whole head, ``lines``
    open edge paths.
    """
    inside = np.concatenate([hole.quads for hole in holes])
    skin = split_quads(quads[~_is_among(quads, inside)])
    new: Array = vertices
    faces: NDArray[np.integer] = skin
    for k, density in enumerate(densities):
        centres = new[faces].mean(axis=1)
        picked = ~_within(centres, vertices, [area for finer in densities[:k] for area in finer.areas], _OVERLAP)
        if density.areas:
            picked &= _within(centres, vertices, density.areas)
        new, faces = _isotropic(new, faces, density.length, picked)
    loops = border_loops(faces)
    rims = {}
    for hole in holes:
        rims[hole.name], new = _lay_rim(new, loops, vertices, hole)
    paths, new = _lay_lines(new, faces, {name: vertices[line] for name, line in lines.items()})
    new = _relax(new, faces, vertices, skin, [*paths.values(), *(arc for pair in rims.values() for arc in pair)])
    places = closest_on_surface(new, vertices, skin)
    for hole in holes:
        faces, places = _sew(faces, places, rims[hole.name], hole, vertices)
        paths[f"{hole.name}_upper"], paths[f"{hole.name}_lower"] = rims[hole.name]
    return Remesh(faces.astype(np.int32), places, paths)


def _within(
    points: Array, vertices: Array, areas: Sequence[tuple[float, tuple[int, ...]]], less: float = 0.0
) -> NDArray[np.bool_]:
    """Mask ``(n,)`` of the points in some area; the areas' reach is made smaller by ``less``."""
    inside = np.zeros(len(points), dtype=bool)
    for reach, near in areas:
        inside |= _distance(points, vertices[list(near)]) < reach - less
    return inside


def _is_among(quads: Index, some: Index) -> NDArray[np.bool_]:
    known = {tuple(quad) for quad in some.tolist()}
    return np.array([tuple(quad) in known for quad in quads.tolist()])


def border_loops(triangles: NDArray[np.integer]) -> list[list[int]]:
    """Closed chains of border vertices, each in the direction of its triangles' own edges."""
    sides = directed_edges(triangles)
    n = int(sides.max()) + 1
    keys = sides[:, 0] * n + sides[:, 1]
    open_sides = sides[~np.isin(keys, sides[:, 1] * n + sides[:, 0])]
    after = dict(open_sides.tolist())
    loops = []
    while after:
        start, vertex = next(iter(after.items()))
        loop = [start]
        del after[start]
        while vertex != start:
            loop.append(vertex)
            vertex = after.pop(vertex)
        loops.append(loop)
    return loops


def _lay_rim(new: Array, loops: list[list[int]], old: Array, hole: Hole) -> tuple[tuple[list[int], list[int]], Array]:
    """Move the border that runs along a hole exactly onto its rim: the upper and the lower arc, corner to corner."""
    curves = [_resampled(old[arc], 0.002) for arc in (hole.upper, hole.lower)]
    curve = np.concatenate(curves)
    loop = min(loops, key=lambda ring: float(_distance(new[ring], curve).mean()))
    corners = [int(np.argmin(np.linalg.norm(new[loop] - old[hole.upper[end]], axis=1))) for end in (0, -1)]
    turned = loop[corners[0] :] + loop[: corners[0]]
    cut = (corners[1] - corners[0]) % len(loop)
    arcs = [turned[: cut + 1], [turned[0], *turned[: cut - 1 : -1]]]
    if _distance(new[arcs[0]], curves[0]).mean() > _distance(new[arcs[0]], curves[1]).mean():
        arcs.reverse()
    moved = new.copy()
    for arc, curve in zip(arcs, curves, strict=True):
        moved[arc] = curve[np.sort(_nearest(new[arc], curve))]
        moved[[arc[0], arc[-1]]] = curve[[0, -1]]
    return (arcs[0], arcs[1]), moved


def _sew(
    faces: NDArray[np.integer], places: sp.csr_matrix, rim: tuple[list[int], list[int]], hole: Hole, vertices: Array
) -> tuple[NDArray[np.integer], sp.csr_matrix]:
    """Put what is behind a rim back: its own faces but for the ring at the rim, which becomes a strip of triangles."""
    on_rim = np.isin(hole.inner_quads, [*hole.upper, *hole.lower]).any(axis=1)
    inner = hole.inner_quads[~on_rim]
    ids, local = np.unique(inner, return_inverse=True)
    inner_faces = split_quads(local.reshape(-1, 4)) + places.shape[0]
    rows = sp.csr_matrix((np.ones(len(ids)), (np.arange(len(ids)), ids)), shape=(len(ids), places.shape[1]))
    joined = sp.vstack([places, rows]).tocsr()
    points = joined @ vertices
    around = set(rim[0]) | set(rim[1])
    outer_loop = next(ring for ring in border_loops(faces) if set(ring) == around)
    inner_loop = max(border_loops(inner_faces), key=len)
    return np.concatenate([faces, inner_faces, _strip(points, outer_loop, inner_loop)]), joined


def _strip(points: Array, outer: list[int], inner: list[int]) -> NDArray[np.int64]:
    """Triangles between two border loops of opposite direction, the one that lags along its length goes on."""
    a = outer[::-1]
    start = int(_nearest(points[[a[0]]], points[inner])[0])
    b = inner[start:] + inner[:start]
    if np.linalg.norm(points[b[len(b) // 4]] - points[a[len(a) // 4]]) > np.linalg.norm(
        points[b[-(len(b) // 4)]] - points[a[len(a) // 4]]
    ):
        raise ValueError("the loops run the same way: the strip would be twisted")
    a, b = [*a, a[0]], [*b, b[0]]
    along_a, along_b = _share_of_length(points[a]), _share_of_length(points[b])
    i = j = 0
    strip = []
    while i < len(a) - 1 or j < len(b) - 1:
        if j == len(b) - 1 or (i < len(a) - 1 and along_a[i + 1] <= along_b[j + 1]):
            strip.append((a[i], a[i + 1], b[j]))
            i += 1
        else:
            strip.append((a[i], b[j + 1], b[j]))
            j += 1
    return np.array(strip, dtype=np.int64)


def _share_of_length(curve: Array) -> Array:
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    return np.asarray(along / along[-1])


def _isotropic(
    vertices: Array, triangles: NDArray[np.integer], length: float, picked: NDArray[np.bool_]
) -> tuple[Array, NDArray[np.integer]]:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, triangles, f_scalar_array=picked.astype(np.float64)))
    meshes.compute_selection_by_condition_per_face(condselect="fq > 0.5")
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=_ITERATIONS,
        targetlen=pymeshlab.PureValue(length),
        selectedonly=True,
        checksurfdist=False,
        featuredeg=180,
    )
    meshes.meshing_remove_unreferenced_vertices()
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix().copy(), mesh.face_matrix().copy()


def _lay_lines(
    vertices: Array, triangles: NDArray[np.integer], curves: dict[str, Array]
) -> tuple[dict[str, list[int]], Array]:
    """Find an edge path along each curve and move its vertices onto the curve."""
    edges = unique_edges(triangles)
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    moved, paths = vertices.copy(), {}
    for name, curve in curves.items():
        dense = _resampled(curve, 0.02 * float(np.median(length)))
        distance = _distance(vertices, dense)
        stray = 0.5 * (distance[edges[:, 0]] ** 2 + distance[edges[:, 1]] ** 2) / length**2
        cost = length * (1 + 20 * stray)
        graph = sp.csr_matrix((cost, (edges[:, 0], edges[:, 1])), shape=(len(vertices),) * 2)
        start, end = _nearest(curve[[0, -1]], vertices).tolist()
        path = _shortest(graph, start, end)
        paths[name] = path
        places = dense[_nearest(vertices[path], dense)]
        places[0], places[-1] = curve[0], curve[-1]
        moved[path] = places
    return paths, moved


def _distance(points: Array, to: Array) -> Array:
    return np.asarray(cKDTree(to).query(points)[0])


def _nearest(points: Array, among: Array) -> Index:
    return np.asarray(cKDTree(among).query(points)[1])


def _shortest(graph: sp.csr_matrix, start: int, end: int) -> list[int]:
    before = dijkstra(graph, directed=False, indices=np.array(start), return_predecessors=True)[1]
    path = [end]
    while path[-1] != start:
        path.append(int(before[path[-1]]))
    return path[::-1]


def _resampled(curve: Array, step: float) -> Array:
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    at = np.linspace(0, along[-1], max(2, int(along[-1] / step)))
    return np.stack([np.interp(at, along, curve[:, k]) for k in range(3)], axis=1)


def _relax(
    new: Array, faces: NDArray[np.integer], old: Array, old_faces: NDArray[np.integer], paths: list[list[int]]
) -> Array:
    """Even out the triangles beside the lines, whose vertices have moved: average, and back onto the surface."""
    neighbours = vertex_adjacency(faces, len(new))
    average = sp.diags(1 / np.asarray(neighbours.sum(1)).ravel()) @ neighbours
    on_line = np.zeros(len(new), dtype=bool)
    on_line[np.concatenate(paths)] = True
    beside = (neighbours @ (neighbours @ on_line.astype(np.float64)) > 0) & ~on_line
    beside &= ~boundary_vertices(faces, len(new))
    for _ in range(_RELAXATIONS):
        new = new.copy()
        new[beside] = 0.5 * new[beside] + 0.5 * (average @ new)[beside]
        new[beside] = closest_on_surface(new[beside], old, old_faces) @ old
    return new


def closest_on_surface(points: Array, vertices: Array, triangles: NDArray[np.integer]) -> sp.csr_matrix:
    """Barycentric rows ``(n, V)`` of the points of the surface closest to ``points`` (n, 3)."""
    import open3d as o3d

    scene = o3d.t.geometry.RaycastingScene()
    corners = np.ascontiguousarray(triangles, dtype=np.uint32)
    scene.add_triangles(np.ascontiguousarray(vertices, dtype=np.float32), corners)
    found = scene.compute_closest_points(np.ascontiguousarray(points, dtype=np.float32))
    face = found["primitive_ids"].numpy().astype(np.int64)
    uv = np.clip(found["primitive_uvs"].numpy().astype(np.float64), 0, 1)
    weights = np.column_stack([np.maximum(1 - uv.sum(1), 0), uv])
    weights /= weights.sum(1, keepdims=True)
    rows = np.repeat(np.arange(len(points)), 3)
    return sp.csr_matrix(
        (weights.ravel(), (rows, corners[face].ravel().astype(np.int64))), shape=(len(points), len(vertices))
    )
