"""The displacement field: coarse-to-fine closest points under a bending and stretching energy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.mesh import TriangleMesh, unique_edges, vertex_normals
from toolkit.mesh.closest import closest_on_polyline
from toolkit.operators import uniform_laplacian
from toolkit.progress import Progress
from toolkit.registration.coarse import Coarse
from toolkit.registration.curves import Curve
from toolkit.registration.parameters import RegistrationParameters
from toolkit.registration.surface import Hits, Surface
from toolkit.solve import factorise

__all__ = ["FieldConstraint", "SheetedSurface", "accepted", "field_constraints", "field_energy", "solve_field"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_REFERENCE_SIZE = 1e4
"""The stiffness is stated for a mesh of this many vertices; a uniform bi-Laplacian grows with the square."""


_INNER_BENDING, _INNER_MEMBRANE = 0.1, 0.1


class SheetedSurface:
    """The target's skin, answering each source vertex without the sheet that cannot be meant.

    Lips that touch have each other's surface at the same distance and, round their edges, normals that tell them
    apart badly; so vertices of the upper lip ask a surface without the lower one, and the other way round.
    """

    def __init__(self, mesh: TriangleMesh, skin: Mask, excluded: Mapping[tuple[str, int], Mask]) -> None:
        """``excluded[opening, side]`` (F,) are the triangles hidden from vertices of that side."""
        usable = skin[mesh.triangles].all(axis=1)
        self._whole = Surface(mesh, np.flatnonzero(usable))
        self._sided = {key: Surface(mesh, np.flatnonzero(usable & ~mask)) for key, mask in excluded.items()}

    def closest(self, points: Array, labels: Mapping[str, NDArray[np.int8]]) -> Hits:
        """Closest points to ``(N, 3)``; ``labels[opening]`` (N,) are the vertices' sheets."""
        hits = self._whole.closest(points)
        for (opening, side), surface in self._sided.items():
            rows = np.flatnonzero(labels[opening] == side)
            if len(rows):
                hits = hits.replaced(rows, surface.closest(points[rows]))
        return hits


@dataclass(frozen=True)
class FieldConstraint:
    """Rows of the field with wanted values: to fixed ``goals`` (n, 3), or to the nearest points of a polyline."""

    rows: sp.csr_matrix
    start: Array
    weight: float
    goals: Array | None = None
    polyline: Array | None = None

    def wanted(self, field: Array) -> Array:
        """Displacements ``(n, 3)`` that the constraint asks for, given the field so far."""
        if self.polyline is None:
            return (self.start if self.goals is None else self.goals) - self.start
        return closest_on_polyline(self.start + self.rows @ field, self.polyline) - self.start


def accepted(hits: Hits, normals: Array, extent: float, parameters: RegistrationParameters) -> Mask:
    """Closest points that may be believed, ``(N,)``: normals agree, not too far, not on the target's open border."""
    agree = np.einsum("nd,nd->n", normals, hits.normals) > np.cos(np.radians(parameters.max_angle))
    return agree & (hits.distance < parameters.max_distance * extent) & ~hits.on_border


def solve_field(
    coarse: Coarse,
    posed: Array,
    reference: Array,
    skin: Mask,
    surface: SheetedSurface,
    labels: Mapping[str, NDArray[np.int8]],
    landmarks: tuple[NDArray[np.int64], Array],
    curves: Sequence[Curve],
    extent: float,
    parameters: RegistrationParameters,
    progress: Progress,
) -> Array:
    """Displacements ``(C, 3)`` of the coarse vertices from the spline's pose.

    Each round solves, with ``L`` the uniform and ``G`` the combinatorial Laplacian,

        min_d  alpha (|L (d - g)|^2 + membrane |d - g|_G^2) + sum_skin |d_i - (c_i - x_i)|^2
               + w_landmark sum |W_l d - r_l|^2 + w_line sum |W_a d - (c_a - x_a)|^2

    with new closest points ``c``; alpha falls from ``stiffness_first`` to ``stiffness_last``.

    Parameters
    ----------
    coarse : the decimated source in the spline's pose, C vertices
    posed : (V, 3) the full source in the spline's pose
    reference : (C, 3) ``g``, from the spline's pose to the pose whose displacement is to be smooth
    skin : (C,) vertices that look for closest points
    labels : sheets of the coarse vertices, by opening
    landmarks : source ids (N,) and target points (N, 3)
    """
    mesh, size = coarse.mesh, coarse.mesh.n_vertices
    energy = field_energy(mesh, skin, parameters.membrane)
    pull = energy @ reference
    constraints = list(field_constraints(coarse, posed, landmarks, curves, parameters))
    field = np.zeros((size, 3))
    steps = np.geomspace(parameters.stiffness_first, parameters.stiffness_last, parameters.stiffness_steps)
    total = len(steps) * parameters.rounds
    for done, alpha in enumerate(np.repeat(steps, parameters.rounds)):
        progress("registering", done, total)
        now = mesh.vertices + field
        hits = surface.closest(now, labels)
        use = accepted(hits, vertex_normals(now, mesh.triangles), extent, parameters) & skin
        matrix = alpha * energy + sp.diags(use.astype(float))
        right = alpha * pull + use[:, None] * (hits.points - mesh.vertices)
        for c in constraints:
            matrix = matrix + c.weight * (c.rows.T @ c.rows)
            right = right + c.weight * (c.rows.T @ c.wanted(field))
        field = factorise(sp.csc_matrix(matrix)).solve(right)
    progress("registering", total, total)
    return field


def field_energy(mesh: TriangleMesh, skin: Mask, membrane: float) -> sp.csr_matrix:
    """Bending and stretching ``(C, C)`` of the skin; what is behind it is a membrane only.

    Bending would carry the slope at a lid's rim on into the socket, where nothing holds it, and out through the
    cheek; a membrane's displacements stay between those of its rims.
    """
    n = mesh.n_vertices
    laplacian = sp.diags(np.where(skin, 1.0, _INNER_BENDING)) @ uniform_laplacian(mesh.triangles, n)
    edges = unique_edges(mesh.triangles)
    weight = np.where(skin[edges].all(axis=1), membrane, max(_INNER_MEMBRANE, membrane))
    rows = np.repeat(np.arange(len(edges)), 2)
    ends = sp.csr_matrix((np.tile([1.0, -1.0], len(edges)), (rows, edges.ravel())), shape=(len(edges), n))
    scale = n / _REFERENCE_SIZE
    # A breath of screening holds the components that nothing touches.
    energy = scale**2 * (laplacian.T @ laplacian) + scale * (ends.T @ sp.diags(weight) @ ends) + 1e-9 * sp.identity(n)
    return sp.csr_matrix(energy)


def field_constraints(
    coarse: Coarse,
    posed: Array,
    landmarks: tuple[NDArray[np.int64], Array],
    curves: Sequence[Curve],
    parameters: RegistrationParameters,
) -> Iterator[FieldConstraint]:
    """Landmarks and curves as rows of the field, in ``solve_field``'s terms."""
    ids, points = landmarks
    yield FieldConstraint(coarse.prolong[ids], posed[ids], parameters.landmark_weight, goals=points)
    for curve in curves:
        rows = coarse.prolong[curve.vertices]
        # A fine curve has more points than the coarse mesh has vertices along it: the weight is per coarse vertex.
        density = min(1.0, np.count_nonzero(rows.getnnz(axis=0)) / len(curve.vertices))
        yield FieldConstraint(rows, posed[curve.vertices], parameters.line_weight * density, polyline=curve.points)
