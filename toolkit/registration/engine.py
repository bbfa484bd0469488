"""Registration: from two faces and landmark pairs to the target's shape on the source's topology."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.errors import RegistrationError
from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh, connected_components, vertex_normals
from toolkit.operators import uniform_laplacian
from toolkit.progress import Progress, silent
from toolkit.registration.coarse import Coarse, decimate
from toolkit.registration.consistency import check_landmarks, extent, misfit
from toolkit.registration.curves import (
    Curve,
    loops_of,
    match_lines,
    opposite_sheets,
    sheet_labels,
    source_rims,
    voted_labels,
)
from toolkit.registration.finish import follow, project, smooth_field, unfold
from toolkit.registration.interior import all_openings, behind_loops, find_interior, minor_components
from toolkit.registration.landmarks import Landmarks
from toolkit.registration.nonrigid import SheetedSurface, solve_field
from toolkit.registration.parameters import RegistrationParameters
from toolkit.registration.quality import (
    RegistrationQuality,
    flipped_triangles,
    share,
    stretched_triangles,
    wrong_sheet,
)
from toolkit.registration.spline import ThinPlateSpline
from toolkit.registration.surface import Hits, Surface
from toolkit.rigid import Similarity, umeyama
from toolkit.solve import factorise

__all__ = ["Registration", "register"]

log = logging.getLogger(__name__)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_ALIKE, _UNLIKE = 0.025, 0.035
"""Misfits (RMS residual of the landmarks' similarity, as a share of their extent) between which the smooth quantity
changes from half the displacement from the similarity's pose to that from the spline's pose. Humans have 0.013 to
0.022, an orc 0.035, a dog 0.09."""
_SPLINE_SMOOTHING = 0.05
"""For alike faces the spline may miss landmarks a little: they are picked at vertices, so to half an edge."""


@dataclass(frozen=True)
class Registration:
    """Target ``T_0`` on the source's topology.

    ``vertices`` (V, 3) in the target's unit and pose; ``distance`` (V,) to the target's surface; ``interior`` (V,)
    bool, followed rather than fitted (mouth bag, eye sockets, other components); ``flipped`` (F,) and
    ``wrong_sheet`` (V,) bool for pictures; ``similarity`` from the source to the target, as the landmarks have it;
    ``warnings`` sentences for the user.
    """

    vertices: Array
    distance: Array
    interior: Mask
    flipped: Mask
    wrong_sheet: Mask
    similarity: Similarity
    quality: RegistrationQuality
    warnings: tuple[str, ...]


def register(
    source: TriangleMesh,
    target: TriangleMesh,
    landmarks: Landmarks,
    curves: Sequence[FeatureLine] = (),
    parameters: RegistrationParameters | None = None,
    progress: Progress = silent,
) -> Registration:
    """Bring the source's topology into the target's shape (the paper's preprocessing; its section 3).

    Similarity and thin-plate spline through the landmarks, then a smooth displacement field on a decimated source
    with closest points, then the skin onto the target's surface. See ``docs/method.md``, section 2.

    Parameters
    ----------
    source, target : the reference meshes, of any topologies, units and poses
    landmarks : 8 pairs at least, 30 to 50 advised
    curves : feature lines; those with ``target_vertices`` draw rims onto rims and tell lips and lids apart; closed
        rims of lips and lids on the source alone still say what lies behind them
    parameters : see `RegistrationParameters`

    Raises
    ------
    InputError : landmarks out of range, used twice or too few
    RegistrationError : landmarks contradict each other or are mirrored; too many triangles turned over; nothing of
        the target found near
    """
    given = parameters or RegistrationParameters()
    warnings = check_landmarks(landmarks, source.vertices, target.vertices)
    progress("preparing the registration", 0, 1)
    job = _Job.prepare(source, target, landmarks, curves, given)
    progress("preparing the registration", 1, 1)
    vertices = job.solve(given, progress)
    result = job.judge(vertices, given, warnings)
    for sentence in result.warnings:
        log.warning("registration: %s", sentence)
    return result


@dataclass(frozen=True)
class _Job:
    """Everything that is known before the first solve."""

    source: TriangleMesh
    target: TriangleMesh
    ids: NDArray[np.int64]
    points: Array
    names: tuple[str, ...]
    similarity: Similarity
    posed: Array
    alike: float
    misfit: float
    extent: float
    curves: list[Curve]
    skin: Mask
    labels: dict[str, NDArray[np.int8]]
    surface: SheetedSurface
    everything: Surface

    @classmethod
    def prepare(
        cls,
        source: TriangleMesh,
        target: TriangleMesh,
        landmarks: Landmarks,
        lines: Sequence[FeatureLine],
        parameters: RegistrationParameters,
    ) -> _Job:
        picked, points = source.vertices[landmarks.source], target.vertices[landmarks.target]
        similarity, size = umeyama(picked, points), extent(points)
        unlikeness = misfit(picked, points)
        alike = float(np.clip((_UNLIKE - unlikeness) / (_UNLIKE - _ALIKE), 0, 1))
        near = similarity.apply(source.vertices)
        posed = ThinPlateSpline(near[landmarks.source], points, _SPLINE_SMOOTHING * alike * size)(near)
        curves = match_lines(lines, source, target, posed)
        rims = source_rims(lines, source)
        loops, target_loops = loops_of(rims), loops_of(curves, on_target=True)
        skin = ~find_interior(source, loops)
        # The same sign on both sides: skin that one side calls hidden would look for its place elsewhere.
        hidden = minor_components(target) | behind_loops(target, target_loops)
        target_skin = ~hidden if all_openings(loops) else ~find_interior(target, target_loops)
        labels = sheet_labels(source, skin, rims, on_target=False)
        everything = Surface(target)
        votes = _voted(source.with_vertices(posed), rims, labels, target, target_skin, everything)
        target_labels = votes | sheet_labels(target, target_skin, curves, on_target=True)
        return cls(
            source=source,
            target=target,
            ids=landmarks.source,
            points=points,
            names=landmarks.names,
            similarity=similarity,
            posed=posed,
            alike=alike,
            misfit=unlikeness,
            extent=size,
            curves=curves,
            skin=skin,
            labels=labels,
            surface=_sheeted(target, target_skin, target_labels),
            everything=everything,
        )

    def solve(self, parameters: RegistrationParameters, progress: Progress) -> Array:
        """Positions ``(V, 3)``."""
        coarse = decimate(self.source.with_vertices(self.posed), parameters.resolution)
        gather = _Gather(coarse)
        # The coarse vertices as combinations of fine ones, so that positions and labels go both ways.
        mesh = coarse.mesh.with_vertices(gather.fit(self.posed))
        coarse = Coarse(mesh, coarse.prolong)
        reference = 0.5 * self.alike * (gather.fit(self.similarity.apply(self.source.vertices)) - mesh.vertices)
        labels = {name: gather.vote(values) for name, values in self.labels.items()}
        field = solve_field(
            coarse,
            self.posed,
            reference,
            gather.share(self.skin) > 0.5,
            self.surface,
            labels,
            (self.ids, self.points),
            self.curves,
            self.extent,
            parameters,
            progress,
        )
        moved = self.posed + smooth_field(self.source.triangles, coarse.prolong @ field)
        if parameters.project:
            rims = [curve for curve in self.curves if curve.opening]
            near = self.source.with_vertices(moved)
            moved = project(near, self.skin, self.surface, self.labels, rims, self.extent, parameters)
        moved = unfold(self.source.with_vertices(self.posed), moved, self.skin)
        _, parts = connected_components(self.source.triangles, self.source.n_vertices)
        return follow(self.source, self.posed, moved, self.skin, parts)

    def judge(self, vertices: Array, parameters: RegistrationParameters, warnings: Sequence[str]) -> Registration:
        """The result with its numbers, or a refusal."""
        hits = self.everything.closest(vertices)
        flipped = flipped_triangles(self.source, vertices, hits, self.skin)
        wrong, judged = wrong_sheet(vertices, self.labels, self.surface, hits, self._sheet_tolerance())
        quality = self._quality(vertices, hits, flipped, wrong, judged)
        self._refuse(quality, parameters)
        return Registration(
            vertices=vertices,
            distance=hits.distance,
            interior=~self.skin,
            flipped=flipped,
            wrong_sheet=wrong,
            similarity=self.similarity,
            quality=quality,
            warnings=(*warnings, *self._doubts(quality)),
        )

    def _quality(self, vertices: Array, hits: Hits, flipped: Mask, wrong: Mask, judged: Mask) -> RegistrationQuality:
        triangles = self.source.triangles
        region = self.skin & self._face()
        faces = np.asarray(region[triangles].all(axis=1))
        distance = hits.distance[region] / self.extent if region.any() else np.zeros(1)
        residual = np.linalg.norm(vertices[self.ids] - self.points, axis=1) / self.extent
        return RegistrationQuality(
            distance_median_share=float(np.median(distance)),
            distance_95_share=float(np.percentile(distance, 95)),
            landmark_median_share=float(np.median(residual)),
            landmark_worst_share=float(residual.max()),
            landmark_worst=self.names[int(np.argmax(residual))],
            flipped_share=share(flipped, faces),
            wrong_sheet_share=share(wrong, judged) if judged.any() else None,
            stretched_share=share(stretched_triangles(self.source, vertices, self.skin), faces),
            misfit=self.misfit,
            accepted_share=float(np.mean(distance < _FOUND)),
        )

    def _sheet_tolerance(self) -> float:
        """Half an edge of the target's rims: where a sheet ends cannot be said more sharply."""
        edges = [np.linalg.norm(np.diff(curve.points, axis=0), axis=1) for curve in self.curves if curve.opening]
        return 0.5 * float(np.median(np.concatenate(edges))) if edges else 0.0

    def _face(self) -> Mask:
        """Vertices ``(V,)`` within the region that the landmarks cover: the rest of a head only follows."""
        picked = self.source.vertices[self.ids]
        reach = 0.25 * extent(picked)
        nearest, _ = cKDTree(picked).query(self.source.vertices, distance_upper_bound=reach)
        return np.asarray(np.isfinite(nearest))

    def _refuse(self, quality: RegistrationQuality, parameters: RegistrationParameters) -> None:
        if quality.accepted_share < _LEAST_FOUND:
            raise RegistrationError(
                f"only {quality.accepted_share:.0%} of the source's face lies on the target after the fit",
                where="registration",
                remedy="check that the landmarks belong to these meshes and that both have their normals outside",
            )
        if quality.flipped_share > parameters.max_flips:
            raise RegistrationError(
                f"{quality.flipped_share:.1%} of the triangles are turned over (limit {parameters.max_flips:.0%})",
                where="registration",
                remedy=f"add landmarks where it folds, and check the worst one, {quality.landmark_worst!r}",
            )

    def _doubts(self, quality: RegistrationQuality) -> list[str]:
        doubts = []
        if quality.flipped_share > 0.005:
            doubts.append(f"{quality.flipped_share:.1%} of the face's triangles are turned over")
        if quality.wrong_sheet_share is not None and quality.wrong_sheet_share > 0.005:
            doubts.append(f"{quality.wrong_sheet_share:.1%} of the vertices near lips and lids lie on the wrong one")
        if quality.landmark_worst_share > 0.03:
            doubts.append(
                f"landmark {quality.landmark_worst!r} is {quality.landmark_worst_share:.1%} of the face's extent away"
            )
        return doubts


_FOUND, _LEAST_FOUND = 0.005, 0.5
"""A vertex is found within this share of the extent; fewer found ones than this share are refused."""


class _Gather:
    """From fine to coarse: least-squares positions and averages, the counterpart of ``Coarse.prolong``."""

    def __init__(self, coarse: Coarse) -> None:
        self._prolong = coarse.prolong
        n = coarse.mesh.n_vertices
        laplacian = uniform_laplacian(coarse.mesh.triangles, n)
        normal = coarse.prolong.T @ coarse.prolong + 1e-4 * (laplacian.T @ laplacian) + 1e-9 * sp.identity(n)
        self._factor = factorise(sp.csc_matrix(normal))
        self._weight = np.maximum(np.asarray(coarse.prolong.sum(axis=0)).ravel(), 1e-12)

    def fit(self, fine: Array) -> Array:
        """Coarse positions ``(C, 3)`` whose prolongation is nearest to ``fine`` (V, 3)."""
        return self._factor.solve(self._prolong.T @ fine)

    def share(self, mask: NDArray) -> Array:
        """Weighted mean ``(C,)`` of a fine quantity round each coarse vertex."""
        return np.asarray(self._prolong.T @ mask.astype(float)) / self._weight

    def vote(self, labels: NDArray[np.int8]) -> NDArray[np.int8]:
        """Label ``(C,)`` of most of the fine vertices round each coarse one, 0 where they are divided."""
        return np.round(self.share(labels)).astype(np.int8)


def _voted(
    posed: TriangleMesh,
    rims: Sequence[Curve],
    labels: Mapping[str, NDArray[np.int8]],
    target: TriangleMesh,
    target_skin: Mask,
    surface: Surface,
) -> dict[str, NDArray[np.int8]]:
    """The target's sheets by the closest points of source vertices that lie well beside their rim."""
    hits = surface.closest(posed.vertices)
    agree = np.einsum("nd,nd->n", vertex_normals(posed.vertices, posed.triangles), hits.normals) > _VOTE_AGREES
    corner = target.triangles[hits.triangles, np.argmax(hits.weights, axis=1)]
    votes = {}
    for name, values in labels.items():
        ids = np.concatenate([rim.vertices for rim in rims if rim.opening == name])
        width = float(np.linalg.norm(np.ptp(posed.vertices[ids], axis=0)))
        beside = cKDTree(posed.vertices[ids]).query(posed.vertices)[0] > _VOTE_BESIDE * width
        upper, lower = (np.unique(corner[(values == side) & beside & agree]) for side in (1, -1))
        votes[name] = voted_labels(target, target_skin, np.setdiff1d(upper, lower), np.setdiff1d(lower, upper), width)
    return votes


_VOTE_BESIDE, _VOTE_AGREES = 0.12, 0.7


def _sheeted(target: TriangleMesh, skin: Mask, labels: Mapping[str, NDArray[np.int8]]) -> SheetedSurface:
    hidden = {
        (name, side): opposite_sheets(target.triangles, values, side)
        for name, values in labels.items()
        for side in (1, -1)
    }
    return SheetedSurface(target, skin, hidden)
