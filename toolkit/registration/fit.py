"""From a prepared pair of faces to positions: one after the other what the other modules do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.mesh import connected_components
from toolkit.progress import Progress
from toolkit.registration.coarse import Coarse, Gather, decimate
from toolkit.registration.finish import follow, project, smooth_field
from toolkit.registration.nonrigid import solve_field
from toolkit.registration.parameters import RegistrationParameters
from toolkit.registration.prepare import Job
from toolkit.registration.unfolding import unfold

__all__ = ["Reduced", "fit", "reduce"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Reduced:
    """A job on a decimated source of C vertices.

    ``coarse`` in the spline's pose, ``gather`` brings fine fields to it; ``reference`` (C, 3) from that pose to the
    one whose displacement is to be smooth; ``skin`` (C,) and ``labels`` (C,) by opening as in the job.
    """

    coarse: Coarse
    gather: Gather
    reference: Array
    skin: Mask
    labels: dict[str, NDArray[np.int8]]


def fit(job: Job, parameters: RegistrationParameters, progress: Progress) -> Array:
    """Positions ``(V, 3)`` of the source's vertices on the target: field, projection, unfolding, followers."""
    reduced = reduce(job, parameters.resolution)
    field = solve_field(
        reduced.coarse,
        job.posed,
        reduced.reference,
        reduced.skin,
        job.surface,
        reduced.labels,
        (job.ids, job.points),
        job.curves,
        job.extent,
        parameters,
        progress,
    )
    moved = job.posed + smooth_field(job.source.triangles, reduced.coarse.prolong @ field)
    if parameters.project:
        rims = [curve for curve in job.curves if curve.opening]
        near = job.source.with_vertices(moved)
        moved = project(near, job.skin, job.surface, job.labels, rims, job.extent, parameters)
    moved = unfold(job.source, moved, job.skin, lambda points: job.surface.closest(points, job.labels))
    _, parts = connected_components(job.source.triangles, job.source.n_vertices)
    return follow(job.source, job.posed, moved, job.skin, parts)


def reduce(job: Job, n_vertices: int) -> Reduced:
    """The job on about ``n_vertices``."""
    coarse = decimate(job.source.with_vertices(job.posed), n_vertices)
    gather = Gather(coarse)
    # The coarse vertices as combinations of fine ones, so that positions and labels go both ways.
    mesh = coarse.mesh.with_vertices(gather.fit(job.posed))
    reference = 0.5 * job.alike * (gather.fit(job.similarity.apply(job.source.vertices)) - mesh.vertices)
    labels = {name: gather.vote(values) for name, values in job.labels.items()}
    return Reduced(Coarse(mesh, coarse.prolong), gather, reference, gather.share(job.skin) > 0.5, labels)
