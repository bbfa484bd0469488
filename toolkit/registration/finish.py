"""From the solved field to the target's surface: rims onto the rim's curve, skin along its own normals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh, vertex_adjacency, vertex_normals
from toolkit.mesh.closest import closest_on_polyline
from toolkit.registration.curves import Curve
from toolkit.registration.nonrigid import SheetedSurface, accepted
from toolkit.registration.parameters import RegistrationParameters
from toolkit.rigid import umeyama
from toolkit.solve import factorise

__all__ = ["follow", "project", "smooth_field"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_STEPS = 4
_NEAR = 0.01
"""Only vertices whose offset is under this share of the extent are moved onto the surface."""
_ERODINGS, _MOSTLY = 3, 0.4
_NEIGHBOURS = 48


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
    rims: Sequence[Curve],
    extent: float,
    parameters: RegistrationParameters,
) -> Array:
    """Positions ``(V, 3)`` on the target's surface, of a mesh that lies near it already.

    Each skin vertex goes along its own (averaged) normal, in Newton steps: a closest point would gather vertices on
    ridges and tear them apart in creases, which is what makes lid rims ragged. Vertices of a rim go to the target's
    rim curve instead, by offsets that are smooth along it. Skin without a believable closest point follows its
    neighbours by a harmonic fill.
    """
    start = mesh.vertices
    points = start.copy()
    known = ~skin
    for rim in rims:
        points[rim.vertices] += _rim_offsets(start[rim.vertices], rim)
        known[rim.vertices] = True
    normals = smooth_field(mesh.triangles, vertex_normals(start, mesh.triangles), rounds=2)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    free = np.flatnonzero(~known)
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
    known[free[good]] = True
    known &= ~_ragged(mesh.triangles, known, skin)
    return start + _harmonic_fill(mesh.triangles, points - start, known)


def _ragged(triangles: NDArray[np.integer], known: Mask, skin: Mask) -> Mask:
    """Skin where found and unfound vertices mix: in ears and hair each vertex finds another place, or none."""
    adjacency = vertex_adjacency(triangles, len(known))
    around = np.maximum(adjacency @ skin.astype(float), 1)
    ragged = np.zeros(len(known), dtype=bool)
    for _ in range(_ERODINGS):
        lost = (adjacency @ (skin & (~known | ragged)).astype(float)) / around > _MOSTLY
        ragged |= skin & lost
    return ragged


def follow(mesh: TriangleMesh, posed: Array, points: Array, skin: Mask, parts: NDArray[np.integer]) -> Array:
    """Carry along what is not skin, ``(V, 3)``: mouth bag, sockets, eyeballs, teeth.

    Each such vertex takes the mean displacement from ``posed`` of the nearest skin, weighted by the inverse square
    of the distance: nearness in space, not along the surface, keeps the bag inside the cheek whatever becomes of it.
    Separate components (``parts`` (V,), all but the skin's) move by the similarity that fits theirs best, so that
    eyeballs stay round.
    """
    hidden = np.flatnonzero(~skin)
    if not len(hidden) or not skin.any():
        return points
    visible = np.flatnonzero(skin)
    distance, nearest = cKDTree(posed[visible]).query(posed[hidden], k=min(_NEIGHBOURS, len(visible)))
    distance, nearest = distance.reshape(len(hidden), -1), nearest.reshape(len(hidden), -1)
    weight = 1 / np.maximum(distance, 1e-9 * mesh.diagonal) ** 2
    weight /= weight.sum(axis=1, keepdims=True)
    displacement = points - posed
    displacement[hidden] = np.einsum("nk,nkd->nd", weight, displacement[visible][nearest])
    even = smooth_field(mesh.triangles, displacement, rounds=30)
    moved = points.copy()
    moved[hidden] = posed[hidden] + even[hidden]
    main = np.bincount(parts[visible]).argmax()
    for part in np.unique(parts[hidden]):
        ids = np.flatnonzero(parts == part)
        if part != main and len(ids) >= 4:
            moved[ids] = _moved_whole(mesh.vertices[ids], moved[ids])
    return moved


def _moved_whole(source: Array, target: Array) -> Array:
    try:
        return umeyama(source, target).apply(source)
    except InputError:  # a part without extent in two directions
        return target


def _rim_offsets(points: Array, rim: Curve) -> Array:
    """Offsets ``(n, 3)`` to the rim's curve, low-passed along it; corners keep theirs.

    The target's line runs along edges, so it zigzags by a share of an edge; what is finer than two of its edges is
    not the rim's shape.
    """
    offsets = closest_on_polyline(points, rim.points) - points
    spacing = np.linalg.norm(np.diff(points, axis=0), axis=1).mean()
    edge = np.linalg.norm(np.diff(rim.points, axis=0), axis=1).mean()
    rounds = int(np.clip(2 * (edge / max(spacing, 1e-300)) ** 2, 1, 100))
    for _ in range(rounds):
        offsets[1:-1] = 0.5 * offsets[1:-1] + 0.25 * (offsets[:-2] + offsets[2:])
    return offsets


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
