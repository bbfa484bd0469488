"""The result of a registration with its numbers, or the reason why it is refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.errors import RegistrationError
from toolkit.registration.consistency import extent
from toolkit.registration.parameters import RegistrationParameters
from toolkit.registration.prepare import Job
from toolkit.registration.quality import (
    RegistrationQuality,
    flipped_triangles,
    share,
    stretched_triangles,
    wrong_sheet,
)
from toolkit.registration.surface import Hits
from toolkit.rigid import Similarity

__all__ = ["Registration", "judge"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FOUND, _LEAST_FOUND = 0.005, 0.5
"""A vertex is found within this share of the extent; fewer found ones than this share are refused."""


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


def judge(job: Job, vertices: Array, parameters: RegistrationParameters, warnings: Sequence[str]) -> Registration:
    """The result with its numbers, or a refusal."""
    hits = job.everything.closest(vertices)
    flipped = flipped_triangles(job.source, vertices, hits, job.skin)
    wrong, judged = wrong_sheet(vertices, job.labels, job.surface, hits, _sheet_tolerance(job))
    quality = _quality(job, vertices, hits, flipped, wrong, judged)
    _refuse(quality, parameters)
    return Registration(
        vertices=vertices,
        distance=hits.distance,
        interior=~job.skin,
        flipped=flipped,
        wrong_sheet=wrong,
        similarity=job.similarity,
        quality=quality,
        warnings=(*warnings, *_doubts(quality)),
    )


def _quality(job: Job, vertices: Array, hits: Hits, flipped: Mask, wrong: Mask, judged: Mask) -> RegistrationQuality:
    triangles = job.source.triangles
    region = job.skin & _face(job)
    faces = np.asarray(region[triangles].all(axis=1))
    distance = hits.distance[region] / job.extent if region.any() else np.zeros(1)
    residual = np.linalg.norm(vertices[job.ids] - job.points, axis=1) / job.extent
    return RegistrationQuality(
        distance_median_share=float(np.median(distance)),
        distance_95_share=float(np.percentile(distance, 95)),
        landmark_median_share=float(np.median(residual)),
        landmark_worst_share=float(residual.max()),
        landmark_worst=job.names[int(np.argmax(residual))],
        flipped_share=share(flipped, faces),
        wrong_sheet_share=share(wrong, judged) if judged.any() else None,
        stretched_share=share(stretched_triangles(job.source, vertices, job.skin), faces),
        misfit=job.misfit,
        accepted_share=float(np.mean(distance < _FOUND)),
    )


def _sheet_tolerance(job: Job) -> float:
    """Half an edge of the target's rims: where a sheet ends cannot be said more sharply."""
    edges = [np.linalg.norm(np.diff(curve.points, axis=0), axis=1) for curve in job.curves if curve.opening]
    return 0.5 * float(np.median(np.concatenate(edges))) if edges else 0.0


def _face(job: Job) -> Mask:
    """Vertices ``(V,)`` within the region that the landmarks cover: the rest of a head only follows."""
    picked = job.source.vertices[job.ids]
    reach = 0.25 * extent(picked)
    nearest, _ = cKDTree(picked).query(job.source.vertices, distance_upper_bound=reach)
    return np.asarray(np.isfinite(nearest))


def _refuse(quality: RegistrationQuality, parameters: RegistrationParameters) -> None:
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


def _doubts(quality: RegistrationQuality) -> list[str]:
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
