"""Checks of one mesh, before any work is done with it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.checks.edges import EdgeTable, edge_table
from toolkit.checks.findings import Finding, and_more
from toolkit.checks.measures import flatness
from toolkit.checks.winding import coherent_flips, is_inside_out
from toolkit.mesh import TriangleMesh

__all__ = [
    "check_mesh",
    "duplicate_faces",
    "flat_faces",
    "is_soup",
    "repeated_corners",
    "unusable",
    "unused_vertices",
]

FLAT = 1e-8
"""A triangle lower than this share of the bounding box's diagonal has no plane to speak of."""

SOUP = 0.1
"""More parts than this share of the faces: the faces share hardly any vertices."""

FAR = 100.0
"""Distance from the origin, in diagonals, at which single precision no longer holds a wrinkle."""


def check_mesh(mesh: TriangleMesh, where: object = "") -> list[Finding]:
    """Check coordinates, faces, manifoldness, winding and parts; errors first, none if the mesh is good.

    An open border is no fault: faces have necks, eyes and mouths. Whatever can be repaired safely is a warning with
    ``repair`` set (`repair_source`, `repair_target`); several parts (eyeballs, teeth) are information.
    """
    place = str(where)
    fatal = unusable(mesh, place)
    if fatal:
        return fatal
    repeated = repeated_corners(mesh.triangles)
    flat = flat_faces(mesh.vertices, mesh.triangles) & ~repeated
    if (repeated | flat).mean() >= 0.5:
        what = f"{np.count_nonzero(repeated | flat)} of {mesh.n_triangles} faces have no area"
        return [Finding("error", what, place, remedy="the mesh is flattened or collapsed, export it again")]
    twice = duplicate_faces(mesh.triangles) & ~(repeated | flat)
    findings = _flawed_faces(mesh.triangles, repeated, flat, twice, place)
    sound = np.flatnonzero(~(repeated | flat | twice))
    findings += _edges_and_winding(mesh.vertices, mesh.triangles[sound], sound, place)
    findings += _unused(mesh, place)
    findings += _far_away(mesh, place)
    return findings


def repeated_corners(triangles: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Mask ``(F,)`` of the triangles that name a vertex twice."""
    a, b, c = np.asarray(triangles).T
    return (a == b) | (b == c) | (c == a)


def flat_faces(vertices: NDArray[np.float64], triangles: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Mask ``(F,)`` of the triangles whose least height is nothing beside the mesh (`FLAT`)."""
    return np.asarray(flatness(vertices, triangles) <= FLAT * np.linalg.norm(np.ptp(vertices, axis=0)))


def duplicate_faces(triangles: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Mask ``(F,)`` of the triangles whose three vertices an earlier triangle has too, in any order."""
    # Sums of one random number a vertex: only faces whose sums are alike can have the same vertices.
    numbers = np.random.default_rng(0).integers(2**63, size=int(np.max(triangles, initial=-1)) + 1, dtype=np.uint64)
    sums = numbers[triangles[:, 0]] + numbers[triangles[:, 1]] + numbers[triangles[:, 2]]
    ordered_sums = np.sort(sums)
    suspects = np.flatnonzero(np.isin(sums, ordered_sums[1:][ordered_sums[1:] == ordered_sums[:-1]]))
    ordered = np.sort(triangles[suspects], axis=1)
    order = np.lexsort((*ordered.T[::-1],))
    mask = np.zeros(len(triangles), dtype=bool)
    mask[suspects[order[1:]]] = (np.diff(ordered[order], axis=0) == 0).all(axis=1)
    return mask


def unused_vertices(triangles: NDArray[np.integer], n_vertices: int) -> NDArray[np.bool_]:
    """Mask ``(V,)`` of the vertices that no triangle uses."""
    mask = np.ones(n_vertices, dtype=bool)
    mask[np.asarray(triangles).ravel()] = False
    return mask


def is_soup(n_parts: int, n_triangles: int) -> bool:
    """Whether the faces share hardly any vertices, as in an STL file read as it stands."""
    return n_triangles > 8 and n_parts > SOUP * n_triangles


def unusable(mesh: TriangleMesh, where: object = "") -> list[Finding]:
    """Errors that forbid any work, even a repair: nothing there, not finite, faces out of range."""
    where = str(where)
    if mesh.n_vertices == 0:
        return [Finding("error", "the mesh has no vertices", where, remedy="export it again, with its geometry")]
    findings = []
    broken = np.flatnonzero(~np.isfinite(mesh.vertices)) // 3
    if len(broken):
        at = ", ".join(f"{x:g}" for x in mesh.vertices[broken[0]])
        what = f"vertex {broken[0]} has the position ({at}), which is not finite{and_more(len(np.unique(broken)))}"
        remedy = "mend or delete it in the program that made the mesh"
        findings.append(Finding("error", what, where, int(broken[0]), remedy))
    elif mesh.diagonal == 0:
        what = f"all {mesh.n_vertices} vertices lie at one point"
        findings.append(Finding("error", what, where, remedy="export the mesh again, with its geometry"))
    if mesh.n_triangles == 0:
        what = f"the mesh has {mesh.n_vertices} vertices but no faces"
        findings.append(Finding("error", what, where, remedy="export it with its faces, not as points"))
        return findings
    outside = np.unique(np.flatnonzero((mesh.triangles < 0) | (mesh.triangles >= mesh.n_vertices)) // 3)
    if len(outside):
        corners = mesh.triangles[outside[0]]
        worst = corners[(corners < 0) | (corners >= mesh.n_vertices)][0]
        what = f"face {outside[0]} uses vertex {worst}, but ids run from 0 to {mesh.n_vertices - 1}"
        remedy = "the file is damaged or cut short, export it again"
        findings.append(Finding("error", what + and_more(len(outside)), where, int(outside[0]), remedy))
    return findings


def _flawed_faces(
    triangles: NDArray[np.integer],
    repeated: NDArray[np.bool_],
    flat: NDArray[np.bool_],
    twice: NDArray[np.bool_],
    where: str,
) -> list[Finding]:
    findings = []
    remedy = "delete such faces, or let them be left out"
    for mask, what in (
        (repeated, "names a vertex twice"),
        (flat, "has no area"),
        (twice, "is there twice"),
    ):
        ids = np.flatnonzero(mask)
        if len(ids):
            corners = " ".join(map(str, triangles[ids[0]]))
            text = f"face {ids[0]} ({corners}) {what}{and_more(len(ids))}"
            findings.append(Finding("warning", text, where, int(ids[0]), remedy, "drop faces"))
    return findings


def _edges_and_winding(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer], face_ids: NDArray[np.int64], where: str
) -> list[Finding]:
    """Manifoldness, parts and winding of the sound faces, whose ids in the file are ``face_ids``."""
    table = edge_table(triangles, len(vertices))
    findings = _crowded_edges(table, face_ids, where) + _parts(table, triangles, where)
    flips, one_sided = coherent_flips(vertices, triangles, table)
    if one_sided.any():
        what = f"face {face_ids[np.argmax(one_sided)]} lies on a one-sided surface, which has no outside"
        remedy = "cut the surface where it is joined wrongly"
        findings.append(Finding("warning", what, where, int(face_ids[np.argmax(one_sided)]), remedy))
    if flips.any():
        first = int(face_ids[np.argmax(flips)])
        what = f"face {first} is turned against its neighbours{and_more(int(np.count_nonzero(flips)))}"
        findings.append(Finding("warning", what, where, first, "make the normals consistent", "orient"))
    if flips.any():
        triangles = np.where(flips[:, None], triangles[:, [0, 2, 1]], triangles)
        table = edge_table(triangles, len(vertices))
    if is_inside_out(vertices, triangles, table):
        what = "the faces look inwards: the mesh is inside out"
        findings.append(Finding("warning", what, where, None, "turn the normals over", "turn over"))
    return findings


def _crowded_edges(table: EdgeTable, face_ids: NDArray[np.int64], where: str) -> list[Finding]:
    crowded = np.flatnonzero(table.counts > 2)
    if len(crowded) == 0:
        return []
    i, j = table.edges[crowded[0]]
    faces = ", ".join(str(face_ids[f]) for f in table.faces_of(int(crowded[0])))
    what = f"edge {i}-{j} is shared by {table.counts[crowded[0]]} faces ({faces}){and_more(len(crowded))}"
    remedy = "separate or delete the faces that do not belong there"
    return [Finding("warning", what, where, int(i), remedy, "split edges")]


def _parts(table: EdgeTable, triangles: NDArray[np.integer], where: str) -> list[Finding]:
    used = ~unused_vertices(triangles, table.n_vertices)
    _, sizes = np.unique(table.parts[used], return_counts=True)
    if is_soup(len(sizes), len(triangles)):
        what = f"the mesh falls into {len(sizes)} separate parts, as its faces share no vertices"
        return [Finding("warning", what, where, None, "merge vertices by distance and export it again", "weld")]
    if len(sizes) < 2:
        return []
    listed = ", ".join(str(size) for size in np.sort(sizes)[::-1][:6]) + (", ..." if len(sizes) > 6 else "")
    return [Finding("info", f"the mesh has {len(sizes)} separate parts, of {listed} vertices", where)]


def _unused(mesh: TriangleMesh, where: str) -> list[Finding]:
    unused = np.flatnonzero(unused_vertices(mesh.triangles, mesh.n_vertices))
    if len(unused) == 0:
        return []
    what = f"vertex {unused[0]} belongs to no face{and_more(len(unused))}"
    remedy = "delete loose vertices if they are not meant"
    return [Finding("info", what, where, int(unused[0]), remedy, "drop vertices")]


def _far_away(mesh: TriangleMesh, where: str) -> list[Finding]:
    far = float(np.abs(mesh.vertices).max()) / mesh.diagonal
    if far <= FAR:
        return []
    what = f"the mesh lies {far:.0f} times its own size away from the origin, where single precision loses wrinkles"
    return [Finding("warning", what, where, None, "move it to the origin")]
