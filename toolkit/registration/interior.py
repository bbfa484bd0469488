"""What of a head is skin, and what lies behind the lips and the lids and only has to follow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from toolkit.mesh import TriangleMesh, vertex_adjacency, vertex_areas, vertex_normals

__all__ = ["all_openings", "behind_loops", "exposure", "find_interior", "minor_components"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_RAYS = 64
_HIDDEN = 0.20
"""Share of the sky, weighted by the cosine, below which a point counts as hidden. The mouth bag and the sockets see
0 to 0.17, lids and the corners of the eyes 0.4 and more; nostrils and the lips' contact are hidden too, and follow."""


_LEAST_PATCH = 1e-3
_ALL_OPENINGS = 3


def find_interior(mesh: TriangleMesh, loops: Sequence[NDArray[np.integer]] = ()) -> Mask:
    """Mask ``(V,)`` of the vertices that are not facial skin: mouth bag, eye sockets, eyeballs, teeth.

    Parameters
    ----------
    mesh : the head
    loops : closed rings of vertex ids (consecutive ones joined by edges) round openings: inner lip line, lid rims.
        Everything that they cut off from the largest part is interior; the ring itself is skin.

    Three signs: another connected component than the largest; cut off by a loop; and, where fewer than three loops
    (the mouth and two eyes) say so, hidden, that is, seeing less than 20 % of the sky.
    """
    known = minor_components(mesh) | behind_loops(mesh, loops)
    return known if all_openings(loops) else known | _hidden(mesh, loops)


def all_openings(loops: Sequence[NDArray[np.integer]]) -> bool:
    """Whether the rims of the mouth and of both eyes are among the loops, as far as their number tells."""
    return len(loops) >= _ALL_OPENINGS


def minor_components(mesh: TriangleMesh) -> Mask:
    """Mask ``(V,)`` of all but the component with the largest area."""
    return _all_but_largest(vertex_adjacency(mesh.triangles, mesh.n_vertices), _areas(mesh))


def behind_loops(mesh: TriangleMesh, loops: Sequence[NDArray[np.integer]]) -> Mask:
    """Mask ``(V,)`` of what closed rings of vertices cut off from the part with the largest area."""
    on_loop = np.zeros(mesh.n_vertices, dtype=bool)
    for loop in loops:
        on_loop[np.asarray(loop)] = True
    if not on_loop.any():
        return np.zeros(mesh.n_vertices, dtype=bool)
    free = sp.diags((~on_loop).astype(float))
    cut = free @ vertex_adjacency(mesh.triangles, mesh.n_vertices) @ free
    return _all_but_largest(sp.csr_matrix(cut), np.where(on_loop, 0.0, _areas(mesh))) & ~on_loop


def exposure(mesh: TriangleMesh) -> Array:
    """Share ``(V,)`` of the sky over each vertex, cosine-weighted, that is not hidden by the mesh itself.

    Deterministic: the same directions for every vertex, those of a spherical Fibonacci set above its tangent plane.
    """
    import open3d as o3d

    centre, scale = mesh.vertices.mean(axis=0), 1.0 / max(mesh.diagonal, 1e-300)
    points = ((mesh.vertices - centre) * scale).astype(np.float32)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(o3d.core.Tensor(points), o3d.core.Tensor(mesh.triangles.astype(np.uint32)))
    normals = vertex_normals(mesh.vertices, mesh.triangles).astype(np.float32)
    start = points + np.float32(1e-4) * normals
    seen, whole = np.zeros(len(points)), np.zeros(len(points))
    for direction in _fibonacci_sphere(_RAYS).astype(np.float32):
        cosine = normals @ direction
        up = np.flatnonzero(cosine > 0)
        rays = np.concatenate([start[up], np.broadcast_to(direction, (len(up), 3))], axis=1)
        blocked = scene.test_occlusions(o3d.core.Tensor(np.ascontiguousarray(rays))).numpy()
        whole[up] += cosine[up]
        seen[up] += np.where(blocked, 0.0, cosine[up])
    return seen / np.maximum(whole, 1e-12)


def _hidden(mesh: TriangleMesh, loops: Sequence[NDArray[np.integer]]) -> Mask:
    """Patches of hidden vertices, speckles smoothed away, that are not tiny and touch no loop.

    Where there is a loop it says better what is skin: lips in contact are, though they see nothing.
    """
    adjacency = vertex_adjacency(mesh.triangles, mesh.n_vertices)
    degree = np.maximum(np.asarray(adjacency.sum(axis=1)).ravel(), 1)
    mask = (exposure(mesh) < _HIDDEN).astype(float)
    for _ in range(3):
        mask = ((adjacency @ mask + mask) / (degree + 1) > 0.5).astype(float)
    hidden, inside, areas = mask > 0, sp.diags(mask), _areas(mesh)
    count, labels = connected_components(sp.csr_matrix(inside @ adjacency @ inside), directed=False)
    share = np.bincount(labels, weights=np.where(hidden, areas, 0.0)) / max(areas.sum(), 1e-300)
    touched = np.zeros(count, dtype=bool)
    for loop in loops:
        touched[labels[np.asarray(loop)]] = True
    return hidden & (share[labels] > _LEAST_PATCH) & ~touched[labels]


def _all_but_largest(adjacency: sp.csr_matrix, areas: Array) -> Mask:
    _, labels = connected_components(adjacency, directed=False)
    return labels != np.argmax(np.bincount(labels, weights=areas))


def _areas(mesh: TriangleMesh) -> Array:
    return vertex_areas(mesh.vertices, mesh.triangles)


def _fibonacci_sphere(n: int) -> Array:
    k = np.arange(n) + 0.5
    height, angle = 1 - 2 * k / n, np.pi * (1 + 5**0.5) * k
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)
