"""From the solved field to the target's surface: rims onto the rim's curve, skin along its own normals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.mesh import TriangleMesh, vertex_adjacency, vertex_normals
from toolkit.registration.curves import Curve, closest_on_polyline
from toolkit.registration.nonrigid import SheetedSurface, accepted
from toolkit.registration.parameters import RegistrationParameters
from toolkit.solve import factorise

__all__ = ["project", "smooth_field"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_STEPS = 4
_NEAR = 0.01
"""Only vertices whose offset is under this share of the extent are moved onto the surface."""


def smooth_field(triangles: NDArray[np.integer], field: Array, rounds: int = 4) -> Array:
    """Take the coarse triangles' facets out of a prolonged field ``(V, 3)``: averages over neighbours."""
    adjacency = vertex_adjacency(triangles, len(field))
    mean = sp.diags(1 / (1 + np.asarray(adjacency.sum(axis=1)).ravel())) @ (
        adjacency + sp.identity(len(field), format="csr")
    )
    for _ in range(rounds):
        field = mean @ field
    return field


def project(
    mesh: TriangleMesh,
    skin: Mask,
    surface: SheetedSurface,
    labels: Mapping[str, NDArray[np.int8]],
    curves: Sequence[Curve],
    extent: float,
    parameters: RegistrationParameters,
) -> Array:
    """Positions ``(V, 3)`` on the target's surface, of a mesh that lies near it already.

    Each skin vertex goes along its own (averaged) normal, in Newton steps: a closest point would gather vertices on
    ridges and tear them apart in creases, which is what makes lid rims ragged. Vertices of a rim go to the nearest
    point of the target's rim curve instead, and everything else (behind the rims, and where no closest point can
    be believed) follows its neighbours by a harmonic fill.
    """
    start = mesh.vertices
    points = start.copy()
    rim = np.zeros(len(start), dtype=bool)
    for curve in curves:
        rim[curve.vertices] = True
        points[curve.vertices] = closest_on_polyline(start[curve.vertices], curve.points)
    normals = smooth_field(mesh.triangles, vertex_normals(start, mesh.triangles), rounds=2)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    free = np.flatnonzero(skin & ~rim)
    held = {name: values[free] for name, values in labels.items()}
    good = np.ones(len(free), dtype=bool)
    for _ in range(_STEPS):
        hits = surface.closest(points[free], held)
        good &= accepted(hits, normals[free], extent, parameters)
        # The tangent plane at the closest point, met along the vertex's normal; steep meetings are not trusted.
        slope = np.einsum("nd,nd->n", normals[free], hits.normals)
        gap = np.einsum("nd,nd->n", hits.points - points[free], hits.normals)
        points[free] += np.where(good, gap / np.maximum(slope, 0.5), 0.0)[:, None] * normals[free]
    good &= np.linalg.norm(points[free] - start[free], axis=1) < _NEAR * extent
    known = rim.copy()
    known[free[good]] = True
    return start + _harmonic_fill(mesh.triangles, points - start, known)


def _harmonic_fill(triangles: NDArray[np.integer], values: Array, known: Mask) -> Array:
    """Values ``(V, 3)`` kept where ``known`` and as even as can be elsewhere, fading to zero far away."""
    unknown = np.flatnonzero(~known)
    if not len(unknown) or not known.any():
        return np.where(known[:, None], values, 0.0)
    adjacency = vertex_adjacency(triangles, len(values))
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    # A little screening holds components that touch nothing known.
    matrix = sp.diags(degree[unknown] * 1.01 + 1e-6) - adjacency[unknown][:, unknown]
    filled = values.copy()
    filled[unknown] = factorise(sp.csc_matrix(matrix)).solve(
        adjacency[unknown][:, np.flatnonzero(known)] @ values[known]
    )
    return filled
