"""Signs that a triangle came out turned over: against its neighbours, or against the target's surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.mesh import face_normals, vertex_normals

__all__ = ["agreement", "backwards"]

Array = NDArray[np.float64]
Ids = NDArray[np.integer]

_FLAT = 0.9
"""Mean length of the target's normals under a triangle from which on they say which side is out."""


def agreement(points: Array, triangles: Ids) -> Array:
    """Cosine ``(F,)``, about, between a triangle's normal and those of its corners."""
    around = vertex_normals(points, triangles)[triangles].mean(axis=1)
    return np.asarray(np.einsum("fd,fd->f", face_normals(points, triangles), around))


def backwards(points: Array, triangles: Ids, outside: Array) -> NDArray[np.bool_]:
    """Mask ``(F,)`` of the triangles with the back to the target's normals ``outside`` (V, 3), where these are sure."""
    out = outside[triangles].mean(axis=1)
    flat = np.linalg.norm(out, axis=1) > _FLAT
    return np.asarray(flat & (np.einsum("fd,fd->f", face_normals(points, triangles), out) < 0))
