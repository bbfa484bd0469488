"""How near a smooth displacement can come: an oracle that knows the surface, and what the shapes themselves say.

The oracle has the landmarks at their true points, the true lines (across, as lines slide along), and for every vertex
the true surface: the tangent plane at its true point. It lacks only where in that plane the vertex lies, which is what
smoothness has to answer. Of several stiffnesses, kinds of stretching and reference poses, the best is taken for each
face in hindsight, which no method may. What it misses by, these landmarks and this kind of smoothness (bending and
stretching of a displacement) cannot give; other landmarks, or a prior learned from faces, might.

It still is told too much: where the surface is curved, its true tangent planes hold a vertex that would slide along it.
The drift is what the registration's own energy makes of the truth: closest points hold it to the surface as they hold
any other answer, landmarks and lines are the picked ones, and it may slide. Where it stops is the energy's minimum,
and sliding on from the registration's own answer leads there as well; a registration that is as good as that has
nothing to gain from a better search, only from another energy.

The last measure asks whether the surfaces' shape could. Relief is the mean height of the surface within 1.2 cm over
the tangent plane, as a share of the radius. Where the oracle is off by more than 0.8 %, compare the source's relief
with the target's at the true point and at the oracle's: where the latter fits better, this
measure of shape leads away from the truth; where the true one fits better, there is something left to use.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh, vertex_adjacency, vertex_areas, vertex_normals
from toolkit.operators import uniform_laplacian
from toolkit.registration import Landmarks, RegistrationParameters
from toolkit.registration.coarse import Gather, decimate
from toolkit.registration.fit import reduce
from toolkit.registration.nonrigid import FieldConstraint, accepted, field_constraints, field_energy
from toolkit.registration.prepare import prepare
from toolkit.registration.spline import ThinPlateSpline
from toolkit.rigid import umeyama
from toolkit.solve import factorise

__all__ = ["Floor", "drifted", "floor", "relief_misfits"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_STIFFNESS, _STRETCHING, _BLENDS = (0.1, 1.0, 10.0), (0.0, 0.003, 0.03), (0.0, 0.5, 1.0)
_LANDMARK, _LINE = 100.0, 5.0
_SCREEN = 1e-3
"""Drag in each round of the drift, against 1 for a vertex's plane."""
_OFF, _RADIUS, _SAMPLED = 0.8, 1.2, 1500


@dataclass(frozen=True)
class Floor:
    """The best smooth answer in hindsight, ``vertices`` (V, 3), and its mean error."""

    vertices: Array
    error: float


def floor(
    source: TriangleMesh,
    truth: Array,
    regions: dict[str, Mask],
    ids: NDArray[np.integer],
    lines: list[FeatureLine],
    skin: Mask,
    size: int = 4000,
) -> dict[str, Floor]:
    """The oracle's best on ``size`` vertices for each region ``(V,)`` by its mean error; ``ids`` are the landmarks."""
    coarse = decimate(source, size)
    gather, prolong, n = Gather(coarse), coarse.prolong, coarse.mesh.n_vertices
    true = gather.fit(truth)
    normals = vertex_normals(true, coarse.mesh.triangles) * (gather.share(skin) > 0.5)[:, None]
    posed = umeyama(source.vertices[ids], truth[ids]).apply(source.vertices)
    rigid, bent = gather.fit(posed), ThinPlateSpline(posed[ids], truth[ids], 0.0)(gather.fit(posed))
    across = _side_by_side(normals)
    known, right = across.T @ across, across.T @ np.einsum("nd,nd->n", normals, true)
    for rows, values, weight in _across_lines(source, truth, lines, prolong):
        known, right = known + weight * (rows.T @ rows), right + weight * (rows.T @ values)
    picked = sp.kron(sp.identity(3), prolong[ids]).tocsr()
    known = known + _LANDMARK * (picked.T @ picked)
    right = right + _LANDMARK * (picked.T @ truth[ids].T.ravel())
    laplacian, adjacency = uniform_laplacian(coarse.mesh.triangles, n), vertex_adjacency(coarse.mesh.triangles, n)
    membrane = sp.diags(np.asarray(adjacency.sum(axis=1)).ravel()) - adjacency
    best: dict[str, Floor] = {}
    for stretching in _STRETCHING:
        # The same balance of bending and stretching as the registration's, at this mesh's size.
        scale = n / 1e4
        energy = scale**2 * (laplacian.T @ laplacian) + scale * stretching * membrane
        for stiffness in _STIFFNESS:
            smooth = sp.kron(sp.identity(3), stiffness * energy + 1e-9 * sp.identity(n)).tocsr()
            factor = factorise(sp.csc_matrix(smooth + known))
            for blend in _BLENDS:
                reference = ((1 - blend) * rigid + blend * bent).T.ravel()
                found = prolong @ factor.solve(smooth @ reference + right).reshape(3, n).T
                error = np.linalg.norm(found - truth, axis=1)
                for name, mask in regions.items():
                    mean = float(error[mask].mean())
                    if name not in best or mean < best[name].error:
                        best[name] = Floor(found, mean)
    return best


def drifted(
    source: TriangleMesh,
    target: TriangleMesh,
    truth: Array,
    landmarks: Landmarks,
    lines: list[FeatureLine],
    size: int = 4000,
    rounds: int = 8,
) -> Array:
    """Where the truth slides to, ``(V, 3)``, held by what the registration knows: its energy's minimum nearby.

    As `toolkit.registration.nonrigid.solve_field` at its last stiffness, but that vertices are held to the tangent
    planes of their closest points, and lines to the lines across them, not to points: they are free to slide.
    """
    given = RegistrationParameters(resolution=size)
    job = prepare(source, target, landmarks, lines)
    known = reduce(job, size)
    mesh, n = known.coarse.mesh, known.coarse.mesh.n_vertices
    energy = given.stiffness_last * field_energy(mesh, known.skin, given.membrane)
    held = list(field_constraints(known.coarse, job.posed, (job.ids, job.points), job.curves, given))
    field = known.gather.fit(truth) - mesh.vertices
    for _ in range(rounds):
        now = mesh.vertices + field
        hits = job.surface.closest(now, known.labels)
        use = accepted(hits, vertex_normals(now, mesh.triangles), job.extent, given) & known.skin
        planes = _side_by_side(hits.normals * use[:, None])
        gaps = np.einsum("nd,nd->n", hits.normals, hits.points - mesh.vertices) * use
        matrix = sp.kron(sp.identity(3), energy + _SCREEN * sp.identity(n)) + planes.T @ planes
        right = (energy @ known.reference + _SCREEN * field).T.ravel() + planes.T @ gaps
        for constraint in held:
            rows, values = _sliding(constraint, field)
            matrix, right = matrix + constraint.weight * (rows.T @ rows), right + constraint.weight * (rows.T @ values)
        field = factorise(sp.csc_matrix(matrix)).solve(right).reshape(3, n).T
    return job.posed + known.coarse.prolong @ field


def _sliding(constraint: FieldConstraint, field: Array) -> tuple[sp.csr_matrix, Array]:
    """Rows ``(3 M, 3 C)`` and values of a constraint, for lines without what points along them."""
    rows, wanted = sp.kron(sp.identity(3), constraint.rows).tocsr(), constraint.wanted(field).T.ravel()
    if constraint.polyline is None:
        return rows, wanted
    along = np.gradient(constraint.start + constraint.rows @ field, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    lengthwise = _side_by_side(along)
    across = sp.identity(len(wanted)) - lengthwise.T @ lengthwise
    return sp.csr_matrix(across @ rows), across @ wanted


def _side_by_side(directions: Array) -> sp.csr_matrix:
    """Rows ``(N, 3 N)`` that take the component of each point along its direction."""
    return sp.hstack([sp.diags(directions[:, k]) for k in range(3)]).tocsr()


def _across_lines(
    source: TriangleMesh, truth: Array, lines: list[FeatureLine], prolong: sp.csr_matrix
) -> list[tuple[sp.csr_matrix, Array, float]]:
    normals, rows = vertex_normals(truth, source.triangles), []
    for line in (x for x in lines if not x.closed):
        ids = line.vertices
        across = np.cross(normals[ids], np.gradient(truth[ids], axis=0))
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
        on = prolong[ids]
        components = sp.hstack([sp.diags(across[:, k]) @ on for k in range(3)]).tocsr()
        density = min(1.0, np.count_nonzero(on.getnnz(axis=0)) / len(ids))
        rows.append((components, np.einsum("nd,nd->n", across, truth[ids]), _LINE * density))
    return rows


def relief_misfits(
    source: TriangleMesh, target: TriangleMesh, truth: Array, found: Array, face: Mask, height: float
) -> tuple[float, float, float]:
    """Mean difference of relief at the true and the found points where these are off, and their share of the face."""
    off = np.flatnonzero(face & (100 * np.linalg.norm(found - truth, axis=1) > _OFF * height))
    share = len(off) / np.count_nonzero(face)
    off = np.random.default_rng(0).choice(off, min(_SAMPLED, len(off)), replace=False)
    size = height / np.linalg.norm(truth[face] - truth[face].mean(axis=0), axis=1).mean()
    own = size * np.linalg.norm(source.vertices[face] - source.vertices[face].mean(axis=0), axis=1).mean()
    normals = vertex_normals(source.vertices, source.triangles)
    wanted = _relief(source, source.vertices[off], normals[off], _RADIUS * own / 18)
    there = []
    for points in (truth, found):
        normals = vertex_normals(points, source.triangles)
        there.append(_relief(target, points[off], normals[off], _RADIUS * height / 18))
    return (*(float(np.abs(wanted - x).mean()) for x in there), share)  # type: ignore[return-value]


def _relief(mesh: TriangleMesh, points: Array, normals: Array, radius: float) -> Array:
    areas, outside = vertex_areas(mesh.vertices, mesh.triangles), vertex_normals(mesh.vertices, mesh.triangles)
    around = cKDTree(mesh.vertices).query_ball_point(points, radius)
    heights = np.zeros(len(points))
    for k, ids in enumerate(around):
        near = np.asarray(ids, dtype=np.int64)
        near = near[outside[near] @ normals[k] > 0.2]
        if len(near):
            rise = (mesh.vertices[near] - points[k]) @ normals[k]
            heights[k] = np.average(rise, weights=areas[near]) / radius
    return heights
