"""Closest points on a triangle mesh, with what a registration has to know about each."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from toolkit.mesh import TriangleMesh
from toolkit.mesh.geometry import vertex_normals
from toolkit.mesh.topology import boundary_edges

__all__ = ["Hits", "Surface"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hits:
    """Closest points of N queries.

    ``points`` (N, 3), ``normals`` (N, 3) interpolated unit normals there, ``triangles`` (N,) ids in the whole mesh,
    ``weights`` (N, 3) barycentric, ``distance`` (N,), ``on_border`` (N,) bool: the point lies on an open border.
    """

    points: Array
    normals: Array
    triangles: NDArray[np.int64]
    weights: Array
    distance: Array
    on_border: NDArray[np.bool_]

    def replaced(self, rows: NDArray[np.integer], other: Hits) -> Hits:
        """The same answers with those of some ``rows`` (n,) taken from ``other``."""
        merged = {}
        for f in fields(self):
            values = getattr(self, f.name).copy()
            values[rows] = getattr(other, f.name)
            merged[f.name] = values
        return Hits(**merged)


class Surface:
    """Answers closest-point queries on a mesh, or on some of its triangles.

    Open3D's scene works in float32: it is built round the mesh's centre, so that an offset costs no digits.
    """

    def __init__(self, mesh: TriangleMesh, triangles: NDArray[np.integer] | None = None) -> None:
        """``triangles`` are the ids to keep, all by default."""
        import open3d as o3d

        self.mesh = mesh
        self._kept = np.arange(mesh.n_triangles) if triangles is None else np.asarray(triangles, dtype=np.int64)
        self._centre = mesh.vertices.mean(axis=0)
        self._scale = 1.0 / max(mesh.diagonal, 1e-300)
        self._tensor = o3d.core.Tensor
        self._scene = o3d.t.geometry.RaycastingScene()
        centred = ((mesh.vertices - self._centre) * self._scale).astype(np.float32)
        self._scene.add_triangles(self._tensor(centred), self._tensor(mesh.triangles[self._kept].astype(np.uint32)))
        self._normals = vertex_normals(mesh.vertices, mesh.triangles)
        self._border_corner = _border_edges_of_triangles(mesh)

    def closest(self, points: NDArray[np.floating]) -> Hits:
        """Closest points to ``(N, 3)``."""
        query = np.asarray(points, dtype=np.float64)
        local = ((query - self._centre) * self._scale).astype(np.float32)
        answer = self._scene.compute_closest_points(self._tensor(np.ascontiguousarray(local)))
        triangles = self._kept[answer["primitive_ids"].numpy().astype(np.int64)]
        uv = answer["primitive_uvs"].numpy().astype(np.float64)
        weights = np.clip(np.stack([1 - uv.sum(axis=1), uv[:, 0], uv[:, 1]], axis=1), 0, 1)
        weights /= weights.sum(axis=1, keepdims=True)
        corners = self.mesh.triangles[triangles]
        points_on = np.einsum("nk,nkd->nd", weights, self.mesh.vertices[corners])
        normals = np.einsum("nk,nkd->nd", weights, self._normals[corners])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
        on_border = np.any(self._border_corner[triangles] & (weights < 1e-3), axis=1)
        return Hits(points_on, normals, triangles, weights, np.linalg.norm(points_on - query, axis=1), on_border)


def _border_edges_of_triangles(mesh: TriangleMesh) -> NDArray[np.bool_]:
    """``(F, 3)``: the edge opposite to corner k lies on an open border."""
    n = mesh.n_vertices
    border = boundary_edges(mesh.triangles).astype(np.int64)
    keys = border[:, 0] * n + border[:, 1]
    t = mesh.triangles.astype(np.int64)
    opposite = np.sort(np.stack([t[:, [1, 2]], t[:, [2, 0]], t[:, [0, 1]]], axis=1), axis=2)
    return np.isin(opposite[..., 0] * n + opposite[..., 1], keys)
