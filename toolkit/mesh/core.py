"""The mesh container. Vertex order is the contract of the whole program: nothing here ever reorders vertices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = ["Polygons", "TriangleMesh"]


@dataclass(frozen=True)
class Polygons:
    """The faces as the file had them (quads, n-gons), kept for export.

    ``counts`` (P,) int32 corners of each face, ``indices`` (sum(counts),) int32 vertex ids, face after face.
    """

    counts: NDArray[np.int32]
    indices: NDArray[np.int32]

    def triangulate(self) -> NDArray[np.int32]:
        """Fan triangulation, always from the first corner: ``(F, 3)``, in face order.

        The choice depends on the connectivity alone, so every frame of a take is split the same way.
        """
        starts = np.concatenate([[0], np.cumsum(self.counts)[:-1]])
        n_fan = self.counts - 2
        face = np.repeat(np.arange(len(self.counts)), n_fan)
        step = np.arange(len(face)) - np.repeat(np.cumsum(n_fan) - n_fan, n_fan)
        first = starts[face]
        corners = np.stack([first, first + step + 1, first + step + 2], axis=1)
        return np.ascontiguousarray(self.indices[corners], dtype=np.int32)


@dataclass(frozen=True)
class TriangleMesh:
    """A triangle mesh.

    ``vertices`` (V, 3) float64 positions in the file's unit, ``triangles`` (F, 3) int32 vertex ids, counter-clockwise
    seen from outside, ``polygons`` the original faces where the file had other than triangles.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    polygons: Polygons | None = None

    @property
    def n_vertices(self) -> int:
        """Number of vertices V."""
        return len(self.vertices)

    @property
    def n_triangles(self) -> int:
        """Number of triangles F."""
        return len(self.triangles)

    @property
    def faces(self) -> Polygons:
        """The faces as they are to be written: the file's own polygons, or the triangles."""
        if self.polygons is not None:
            return self.polygons
        return Polygons(np.full(self.n_triangles, 3, dtype=np.int32), self.triangles.ravel())

    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box, in the mesh's unit."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def with_vertices(self, vertices: NDArray[np.floating]) -> TriangleMesh:
        """Return the same connectivity with other positions ``(V, 3)``."""
        moved = np.ascontiguousarray(vertices, dtype=np.float64)
        if moved.shape != self.vertices.shape:
            raise ValueError(f"expected vertices of shape {self.vertices.shape}, got {moved.shape}")
        return replace(self, vertices=moved)
