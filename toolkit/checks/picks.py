"""Checks of what the user picked on the meshes: landmarks and feature lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from toolkit.checks.edges import edge_table
from toolkit.checks.findings import Finding
from toolkit.checks.mesh import repeated_corners, unused_vertices
from toolkit.mesh import TriangleMesh

__all__ = ["ADVISED_LANDMARKS", "NEEDED_LANDMARKS", "check_feature_lines", "check_landmarks"]

NEEDED_LANDMARKS = 8
"""A spline in space needs four, not in one plane; four more tell a wrong one. The registration asks for as many."""

ADVISED_LANDMARKS = 30
"""Below this the registration's error grows quickly; 40 to 50 are better still."""


_MIRROR = 0.5
"""A mirrored fit that leaves less than this share of what the plain one does means that left and right are swapped."""

CLOSED = '"closed": true'


class Line(Protocol):
    """A feature line: its name, whether it is a loop, and its vertex ids in order."""

    @property
    def name(self) -> str: ...
    @property
    def closed(self) -> bool: ...
    @property
    def vertices(self) -> Sequence[int] | NDArray[np.integer]: ...


def check_landmarks(
    names: Sequence[str],
    source_ids: Sequence[int] | NDArray[np.integer],
    target_ids: Sequence[int] | NDArray[np.integer],
    source: TriangleMesh,
    target: TriangleMesh,
    where: object = "",
) -> list[Finding]:
    """Check landmark pairs: ids in range and on the surface, no name or vertex twice, enough of them, and spread out.

    ``names``, ``source_ids`` and ``target_ids`` (N,) belong together; ids count from 0.
    """
    place = str(where)
    sides = [("source", np.asarray(source_ids, dtype=np.int64), source)]
    sides += [("target", np.asarray(target_ids, dtype=np.int64), target)]
    findings = _repeats("name", list(names), list(names), place)
    for side, ids, mesh in sides:
        findings += _off_the_mesh(side, names, ids, mesh, place)
        findings += _repeats(f"{side} vertex", names, ids.tolist(), place)
    if len(names) < NEEDED_LANDMARKS:
        what = f"{len(names)} landmarks are given, at least {NEEDED_LANDMARKS} are needed"
        findings.append(Finding("error", what, place, None, "pick more pairs, 40 to 50 are best"))
    if findings:
        return findings
    points = [mesh.vertices[ids] for _, ids, mesh in sides]
    findings = [f for (side, _, _), p in zip(sides, points, strict=True) for f in _badly_spread(side, names, p, place)]
    findings += _mirrored(points[0], points[1], place) if not findings else []
    if len(names) < ADVISED_LANDMARKS:
        what = f"only {len(names)} landmarks are given"
        remedy = "40 to 50 give a better registration: quarters of lids and lips, cheeks, jaw"
        findings.append(Finding("info", what, place, None, remedy))
    return findings


def check_feature_lines(lines: Iterable[Line], mesh: TriangleMesh, where: object = "") -> list[Finding]:
    """Check feature lines on a mesh: ids in range, enough of them, none twice, an edge path from each to the next.

    Consecutive vertices need not be neighbours: a line is drawn by shortest edge path through the picked ones.
    """
    place = str(where)
    lines = list(lines)
    names = [line.name for line in lines]
    findings = _repeats("name", names, names, place, kind="feature lines")
    whole = mesh.triangles[~repeated_corners(mesh.triangles)]
    parts = edge_table(whole, mesh.n_vertices).parts
    for index, line in enumerate(lines):
        findings += _check_line(line, index, parts, place)
    return findings


def _check_line(line: Line, index: int, parts: NDArray[np.int32], where: str) -> list[Finding]:
    ids, name = np.asarray(line.vertices, dtype=np.int64), f"feature line '{line.name}'"
    needed = 3 if line.closed else 2
    if len(ids) < needed:
        what = f"{name} has {len(ids)} vertices, {'a closed' if line.closed else 'an open'} one needs {needed}"
        return [Finding("error", what, where, index, "pick more vertices along it, or remove it")]
    outside = np.flatnonzero((ids < 0) | (ids >= len(parts)))
    if len(outside):
        what = f"{name} has vertex {ids[outside[0]]} at place {outside[0]}, but ids run from 0 to {len(parts) - 1}"
        return [Finding("error", what, where, index, "pick it again on the reference in use")]
    return _check_course(ids, name, line.closed, parts, (where, index))


def _check_course(
    ids: NDArray[np.int64], name: str, closed: bool, parts: NDArray[np.int32], place: tuple[str, int]
) -> list[Finding]:
    """A line has to get somewhere at every step, on one part, and better not twice to one vertex."""
    if ids[0] == ids[-1]:
        what = f"{name} ends with its first vertex {ids[0]}"
        remedy = f"leave the last vertex out{'' if closed else ' and set ' + CLOSED}"
        return [Finding("error", what, *place, remedy)]
    halts = np.flatnonzero(ids[1:] == ids[:-1])
    if len(halts):
        what = f"{name} has vertex {ids[halts[0]]} twice in a row, at place {halts[0]}"
        return [Finding("error", what, *place, "remove one of them")]
    apart = np.flatnonzero(parts[ids] != parts[ids[0]])
    if len(apart):
        k = int(apart[0])
        what = f"{name} goes from vertex {ids[k - 1]} to {ids[k]}, which no edge path joins"
        return [Finding("error", what, *place, "keep a line on one connected part of the mesh")]
    values, counts = np.unique(ids, return_counts=True)
    if (counts > 1).any():
        what = f"{name} comes to vertex {values[np.argmax(counts > 1)]} twice"
        return [Finding("warning", what, *place, "pick it again without going back and forth")]
    return []


def _off_the_mesh(
    side: str, names: Sequence[str], ids: NDArray[np.int64], mesh: TriangleMesh, where: str
) -> list[Finding]:
    outside = np.flatnonzero((ids < 0) | (ids >= mesh.n_vertices))
    if len(outside):
        k = int(outside[0])
        what = f"landmark '{names[k]}' is {side} vertex {ids[k]}, but ids run from 0 to {mesh.n_vertices - 1}"
        return [Finding("error", what, where, k, f"pick it again on the {side} in use")]
    loose = np.flatnonzero(unused_vertices(mesh.triangles, mesh.n_vertices)[ids])
    if len(loose):
        k = int(loose[0])
        what = f"landmark '{names[k]}' is {side} vertex {ids[k]}, which belongs to no face"
        return [Finding("error", what, where, k, "pick a vertex of the surface")]
    return []


def _repeats(
    what: str, names: Sequence[str], values: Sequence[object], where: str, kind: str = "landmarks"
) -> list[Finding]:
    """Report the first value that is there twice."""
    seen: dict[object, int] = {}
    for index, value in enumerate(values):
        if value in seen:
            first, second = names[seen[value]], names[index]
            text = f"{kind} '{first}' and '{second}' have the same {what} {value}"
            if what == "name":
                text = f"two {kind} have the name '{value}'"
            return [Finding("error", text, where, index, "correct or remove one of them")]
        seen[value] = index
    return []


def _badly_spread(side: str, names: Sequence[str], points: NDArray[np.float64], where: str) -> list[Finding]:
    """Landmarks at one point, on a line or in a plane: the first map between the faces is not determined then."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    order = np.lexsort(points.T)
    gaps = np.linalg.norm(np.diff(points[order], axis=0), axis=1)
    if spread[0] > 0 and gaps.min() == 0:
        k = int(np.argmin(gaps))
        a, b = sorted((int(order[k]), int(order[k + 1])))
        what = f"landmarks '{names[a]}' and '{names[b]}' lie at the same point of the {side}"
        return [Finding("error", what, where, b, "correct or remove one of them")]
    if spread[2] <= 1e-3 * spread[0]:
        shape = "on one line" if spread[1] <= 1e-3 * spread[0] else "in one plane"
        what = f"the {side}'s landmarks lie {shape}"
        return [Finding("error", what, where, None, "pick some elsewhere, e.g. nose tip, chin and ears")]
    return []


def _mirrored(source: NDArray[np.float64], target: NDArray[np.float64], where: str) -> list[Finding]:
    """Left and right swapped: a mirror image of the source fits the target far better than the source does.

    With the covariance's singular values s, the best rotation leaves ``1 - (s1 + s2 + d s3)^2`` of the target's
    spread (both normalised), d = +1 or -1 the sign of its determinant (Umeyama 1991); a reflection has the other d.
    """
    a, b = ((p - p.mean(axis=0)) / np.linalg.norm(p - p.mean(axis=0)) for p in (source, target))
    u, s, vt = np.linalg.svd(a.T @ b)
    if np.linalg.det(u @ vt) > 0:
        return []
    as_it_is, mirrored = 1 - (s[0] + s[1] - s[2]) ** 2, 1 - s.sum() ** 2
    if mirrored > _MIRROR * as_it_is:
        return []
    what = "the landmarks fit only a mirror image of the source: left and right seem swapped on one face"
    return [Finding("error", what, where, None, "use the character's own left and right on both faces")]
