"""All checks of one transfer's input in their order, with the repairs between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from toolkit.checks.findings import Finding, Severity, log_findings, raise_for
from toolkit.checks.mesh import check_mesh
from toolkit.checks.picks import check_feature_lines, check_landmarks
from toolkit.checks.repair import Repair, repair_source, repair_target
from toolkit.checks.scale import check_scale
from toolkit.checks.seams import check_source_seams, join_seams
from toolkit.checks.sequence import check_pair, check_sequence
from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh
from toolkit.meshio.sequence import FrameSequence
from toolkit.progress import Progress, silent

__all__ = ["CheckedInputs", "Places", "check_inputs"]

Ids = NDArray[np.int64]


@dataclass(frozen=True)
class Places:
    """Where each input came from, for the messages: file names."""

    source: str = "source reference"
    target: str = "target reference"
    landmarks: str = "landmarks"
    feature_lines: str = "feature lines"


@dataclass(frozen=True)
class CheckedInputs:
    """Inputs that work can begin with.

    ``source`` has the vertices that were given, in their order. ``target`` may be another mesh than was given:
    ``target_vertex_map`` (V_given,) says where its vertices went (-1: removed), and ``target_ids`` (N,), the
    landmarks, and the ``target_vertices`` of ``lines`` are ids of the new one. ``findings`` and ``notes`` (what was
    repaired) have been said in the log.
    """

    source: TriangleMesh
    target: TriangleMesh
    target_ids: Ids
    lines: tuple[FeatureLine, ...]
    target_vertex_map: Ids
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]


def check_inputs(
    source: TriangleMesh,
    sequence: FrameSequence,
    target: TriangleMesh,
    *,
    names: Sequence[str],
    source_ids: Sequence[int] | NDArray[np.integer],
    target_ids: Sequence[int] | NDArray[np.integer],
    lines: Sequence[FeatureLine] = (),
    places: Places | None = None,
    progress: Progress = silent,
) -> CheckedInputs:
    """Check everything, quick checks first, reading the take last; repair the two meshes.

    ``names``, ``source_ids``, ``target_ids`` (N,) are the landmark pairs, ids from 0.

    Raises
    ------
    InputError : the first error found, of the first step that finds any
    """
    places = places or Places()
    on_target = [replace(line, vertices=line.target_vertices) for line in lines if line.target_vertices is not None]
    said: list[Finding] = []

    def judge(findings: list[Finding]) -> None:
        raise_for(findings)
        # What is repaired is said by the repair.
        log_findings(finding for finding in findings if finding.repair is None or finding.severity == "info")
        said.extend(findings)

    judge(_not_to_be_welded(check_mesh(source, places.source)) + check_mesh(target, places.target))
    judge(check_pair(source, sequence, places.source))
    judge(check_source_seams(source, sequence, places.source))
    judge(check_landmarks(names, source_ids, target_ids, source, target, places.landmarks))
    judge(check_feature_lines(lines, source, places.feature_lines))
    joined = Repair(target, np.arange(target.n_vertices), ())
    if not np.array_equal(source.triangles, target.triangles):  # else its vertices are to stay as the source's
        joined = join_seams(target, [line for line in on_target if not line.guide], places.target)
    on_joined = [replace(line, vertices=_followed(line.vertices, joined.vertex_map)) for line in on_target]
    judge(check_feature_lines(on_joined, joined.mesh, f"{places.feature_lines} (target)"))
    judge(_idle_guides(lines, places))
    judge(check_scale(source.vertices[np.asarray(source_ids)], target.vertices[np.asarray(target_ids)], places.target))
    good_source, good_target = repair_source(source, places.source), repair_target(joined.mesh, places.target)
    moved = good_target.vertex_map[joined.vertex_map]
    judge(_lost_picks(names, target_ids, on_target, moved, places))
    judge(check_sequence(sequence, source, progress=progress))
    return CheckedInputs(
        good_source.mesh,
        good_target.mesh,
        moved[np.asarray(target_ids, dtype=np.int64)],
        tuple(
            line if line.target_vertices is None else replace(line, target_vertices=moved[line.target_vertices])
            for line in lines
        ),
        moved,
        tuple(said),
        good_source.notes + joined.notes + good_target.notes,
    )


def _not_to_be_welded(findings: list[Finding]) -> list[Finding]:
    """A source's vertices are the take's: what only other ones could mend is refused, or said and left."""
    unmended: dict[str | None, Severity] = {"weld": "error", "split edges": "warning"}
    return [
        replace(finding, severity=unmended[finding.repair], repair=None) if finding.repair in unmended else finding
        for finding in findings
    ]


def _followed(ids: Ids, vertex_map: Ids) -> Ids:
    """Where ids ``(n,)`` went; what is no vertex stays what it is, for the check that says so."""
    inside = (ids >= 0) & (ids < len(vertex_map))
    return np.where(inside, vertex_map[np.where(inside, ids, 0)], ids)


def _idle_guides(lines: Sequence[FeatureLine], places: Places) -> list[Finding]:
    """Guides that are on one face only: nothing uses them."""
    return [
        Finding(
            "warning",
            f"guide '{line.name}' is not drawn on the target, so nothing uses it",
            places.feature_lines,
            index,
            "draw it there, or delete it",
        )
        for index, line in enumerate(lines)
        if line.guide and line.target_vertices is None
    ]


def _lost_picks(
    names: Sequence[str],
    target_ids: Sequence[int] | NDArray[np.integer],
    target_lines: Sequence[FeatureLine],
    vertex_map: Ids,
    places: Places,
) -> list[Finding]:
    """Picks on target vertices that only broken faces used."""
    picks = [(places.landmarks, f"landmark '{name}'", id_) for name, id_ in zip(names, target_ids, strict=True)]
    for line in target_lines:
        picks += [(places.feature_lines, f"feature line '{line.name}'", id_) for id_ in line.vertices]
    return [
        Finding("error", f"{what} is on target vertex {id_}, which only broken faces use", where, int(id_), "move it")
        for where, what, id_ in picks
        if vertex_map[id_] < 0
    ]
