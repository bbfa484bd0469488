"""Registration: from two faces and landmark pairs to the target's shape on the source's topology."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from toolkit.checks import check_landmarks, raise_for
from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh
from toolkit.progress import Progress, silent
from toolkit.registration.consistency import refuse_contradictions
from toolkit.registration.fit import fit
from toolkit.registration.judge import Registration, judge
from toolkit.registration.landmarks import Landmarks
from toolkit.registration.parameters import RegistrationParameters
from toolkit.registration.prepare import prepare

__all__ = ["Registration", "register"]

log = logging.getLogger(__name__)


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
    InputError : landmarks out of range, used twice, too few, all in one plane or mirrored
    RegistrationError : landmarks contradict each other; too many triangles turned over; nothing of the target near
    """
    given = parameters or RegistrationParameters()
    findings = check_landmarks(landmarks.names, landmarks.source, landmarks.target, source, target, "landmarks")
    raise_for(findings)
    warnings = [finding.what for finding in findings]
    warnings += refuse_contradictions(landmarks, source.vertices, target.vertices)
    progress("preparing the registration", 0, 1)
    job = prepare(source, target, landmarks, curves)
    progress("preparing the registration", 1, 1)
    vertices = fit(job, given, progress)
    result = judge(job, vertices, given, warnings)
    for sentence in result.warnings:
        log.warning("registration: %s", sentence)
    return result
