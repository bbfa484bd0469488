"""What is known before the first solve: poses, curves, sheets, and the surfaces to ask."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh, vertex_normals
from toolkit.registration.consistency import extent, misfit
from toolkit.registration.curves import (
    Curve,
    loops_of,
    match_lines,
    opposite_sheets,
    sheet_labels,
    source_rims,
    voted_labels,
)
from toolkit.registration.interior import all_openings, behind_loops, find_interior, minor_components
from toolkit.registration.landmarks import Landmarks
from toolkit.registration.nonrigid import SheetedSurface
from toolkit.registration.spline import ThinPlateSpline
from toolkit.registration.surface import Surface
from toolkit.rigid import Similarity, umeyama

__all__ = ["Job", "prepare"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_ALIKE, _UNLIKE = 0.025, 0.035
"""Misfits (RMS residual of the landmarks' similarity, as a share of their extent) between which the smooth quantity
changes from half the displacement from the similarity's pose to that from the spline's pose. Humans have 0.013 to
0.022, an orc 0.035, a dog 0.09."""
_SPLINE_SMOOTHING = 0.05
"""For alike faces the spline may miss landmarks a little: they are picked at vertices, so to half an edge."""
_VOTE_BESIDE, _VOTE_AGREES = 0.12, 0.7


@dataclass(frozen=True)
class Job:
    """Everything that is known before the first solve.

    ``ids`` (N,) source vertices of the landmarks, ``points`` (N, 3) their goals; ``posed`` (V, 3) the source where
    the landmarks' spline puts it; ``alike`` 1 for faces that a similarity brings together, 0 for unlike ones;
    ``misfit`` and ``extent`` of the landmarks; ``skin`` (V,) what is fitted; ``labels`` (V,) sheets by opening.
    """

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


def prepare(
    source: TriangleMesh,
    target: TriangleMesh,
    landmarks: Landmarks,
    lines: Sequence[FeatureLine],
) -> Job:
    """Poses, curves, sheets and surfaces; takes a few seconds at 100K vertices."""
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
    return Job(
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


def _sheeted(target: TriangleMesh, skin: Mask, labels: Mapping[str, NDArray[np.int8]]) -> SheetedSurface:
    hidden = {
        (name, side): opposite_sheets(target.triangles, values, side)
        for name, values in labels.items()
        for side in (1, -1)
    }
    return SheetedSurface(target, skin, hidden)
