"""Safe repairs: of a target, whose topology is free, and of a source, whose vertices are sacred."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from toolkit.checks.edges import edge_table
from toolkit.checks.findings import raise_for
from toolkit.checks.mesh import duplicate_faces, flat_faces, is_soup, repeated_corners, unusable, unused_vertices
from toolkit.checks.winding import coherent_flips, is_inside_out
from toolkit.mesh import Polygons, TriangleMesh

__all__ = ["Repair", "repair_source", "repair_target", "said"]

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Repair:
    """A repaired mesh, where its vertices came from, and what was done.

    ``vertex_map`` (V_old,) int64: the new id of each old vertex, -1 where it was removed; ``notes`` one sentence
    each, none if the mesh was good, in which case ``mesh`` is the very mesh that was given.
    """

    mesh: TriangleMesh
    vertex_map: NDArray[np.int64]
    notes: tuple[str, ...]


def repair_source(mesh: TriangleMesh, where: object = "") -> Repair:
    """Leave out faces without area and turn faces that look the wrong way; no vertex moves, comes or goes.

    The frames of a take have no faces of their own, so this is safe. Loose vertices stay and are carried along, and
    so do non-manifold edges. ``mesh.polygons`` follow: they are turned too, and lose their repeated corners.
    """
    raise_for(unusable(mesh, where))
    notes: list[str] = []
    mesh = _without_repeated_corners(mesh, notes)
    bad = flat_faces(mesh.vertices, mesh.triangles) | duplicate_faces(mesh.triangles)
    mesh = _turned(mesh, ~bad, notes)
    if bad.any():
        notes.append(f"left out {_faces(bad)} without area or there twice")
        mesh = replace(mesh, triangles=np.ascontiguousarray(mesh.triangles[~bad]))
    return said(Repair(mesh, np.arange(mesh.n_vertices), tuple(notes)), where)


def repair_target(mesh: TriangleMesh, where: object = "") -> Repair:
    """Make a clean surface of a target: its own topology is not kept by the transfer, only its shape.

    Faces without area or there twice and loose vertices are removed, edges with more than two faces are split, a soup
    of unconnected triangles is merged, winding is made coherent and outward. Nothing moves; the polygons are dropped
    if any face changed.
    """
    raise_for(unusable(mesh, where))
    notes: list[str] = []
    triangles = _clean_faces(mesh, notes)
    merge = _falls_apart(triangles, mesh.n_vertices)
    crowded = np.count_nonzero(edge_table(triangles, mesh.n_vertices).counts > 2)
    loose = np.count_nonzero(unused_vertices(mesh.triangles, mesh.n_vertices))
    vertices, vertex_map = mesh.vertices, np.arange(mesh.n_vertices)
    if notes or merge or crowded or loose:
        vertices, triangles, vertex_map = _rebuild(mesh.vertices, triangles, merge)
        notes += [f"merged vertices at the same place, {mesh.n_vertices} -> {len(vertices)}"] if merge else []
        notes += [f"split {crowded} edges that more than two faces share"] if crowded else []
        notes += [f"removed {loose} vertices that belong to no face"] if loose else []
    changed = TriangleMesh(vertices, triangles) if notes else mesh
    sound = np.ones(changed.n_triangles, dtype=bool)
    return said(Repair(_turned(changed, sound, notes), vertex_map, tuple(notes)), where)


def _clean_faces(mesh: TriangleMesh, notes: list[str]) -> NDArray[np.int32]:
    bad = repeated_corners(mesh.triangles) | flat_faces(mesh.vertices, mesh.triangles)
    bad |= duplicate_faces(mesh.triangles)
    if bad.any():
        notes.append(f"removed {_faces(bad)} without area or there twice")
    return np.ascontiguousarray(mesh.triangles[~bad])


def _falls_apart(triangles: NDArray[np.int32], n_vertices: int) -> bool:
    used = ~unused_vertices(triangles, n_vertices)
    return is_soup(len(np.unique(edge_table(triangles, n_vertices).parts[used])), len(triangles))


def _rebuild(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], merge: bool
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.int64]]:
    """Let pymeshlab mend the surface, and find each old vertex again by the id that it carries as its quality.

    Splitting gives copies the same quality, so the first copy is taken; merged vertices are found by their position.
    """
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    ids = np.arange(len(vertices), dtype=np.float64)
    meshes.add_mesh(pymeshlab.Mesh(vertices, triangles, v_scalar_array=ids))
    if merge:
        meshes.meshing_remove_duplicate_vertices()
        meshes.meshing_remove_duplicate_faces()
    # Splitting loses no face; removing the smallest ones at such an edge could open the skin.
    meshes.meshing_repair_non_manifold_edges(method="Split Vertices")
    meshes.meshing_remove_unreferenced_vertices()
    result = meshes.current_mesh()  # dies with its MeshSet: copy the arrays now
    new_vertices = np.array(result.vertex_matrix(), dtype=np.float64)
    new_triangles = np.array(result.face_matrix(), dtype=np.int32)
    carried = np.array(result.vertex_scalar_array()).round().astype(np.int64)

    vertex_map = np.full(len(vertices), -1, dtype=np.int64)
    vertex_map[carried[::-1]] = np.arange(len(carried))[::-1]
    if merge:
        _, same_place = np.unique(vertices, axis=0, return_inverse=True)
        same_place = same_place.reshape(-1)
        kept = np.full(same_place.max() + 1, -1, dtype=np.int64)
        kept[same_place[carried]] = np.arange(len(carried))
        vertex_map = kept[same_place]
    return new_vertices, new_triangles, vertex_map


def _without_repeated_corners(mesh: TriangleMesh, notes: list[str]) -> TriangleMesh:
    bad = repeated_corners(mesh.triangles)
    if not bad.any():
        return mesh
    notes.append(f"left out {_faces(bad)} that name a vertex twice")
    polygons = _distinct_corners(mesh.polygons) if mesh.polygons else None
    triangles = polygons.triangulate() if polygons else np.ascontiguousarray(mesh.triangles[~bad])
    triangles = np.ascontiguousarray(triangles[~repeated_corners(triangles)])
    return TriangleMesh(mesh.vertices, triangles, polygons)


def _distinct_corners(polygons: Polygons) -> Polygons:
    """Drop corners that repeat the one before, and polygons that have fewer than three left."""
    counts, indices = polygons.counts, polygons.indices
    face = np.repeat(np.arange(len(counts)), counts)
    ends = np.cumsum(counts)
    before = np.arange(len(indices)) - 1
    before[ends - counts] = ends - 1
    keep = indices != indices[before]
    left = np.bincount(face[keep], minlength=len(counts))
    keep &= (left >= 3)[face]
    return Polygons(left[left >= 3].astype(np.int32), indices[keep])


def _turned(mesh: TriangleMesh, sound: NDArray[np.bool_], notes: list[str]) -> TriangleMesh:
    """Make neighbours agree and the largest part look outwards, judged by the sound faces ``(F,)`` alone."""
    triangles = mesh.triangles[sound]
    table = edge_table(triangles, mesh.n_vertices)
    flips, _ = coherent_flips(mesh.vertices, triangles, table)
    if flips.any():
        triangles = np.where(flips[:, None], triangles[:, [0, 2, 1]], triangles)
        table = edge_table(triangles, mesh.n_vertices)
        notes.append(f"turned {_faces(flips)} to agree with the neighbours")
    of_all = np.zeros(mesh.n_triangles, dtype=bool)
    of_all[sound] = flips
    if is_inside_out(mesh.vertices, triangles, table):
        notes.append("turned all faces over, they looked inwards")
        of_all = ~of_all
    return _flip(mesh, of_all) if of_all.any() else mesh


def _flip(mesh: TriangleMesh, flips: NDArray[np.bool_]) -> TriangleMesh:
    """Turn the chosen triangles over, and the polygons they were cut from; face order and vertices stay."""
    triangles = np.where(flips[:, None], mesh.triangles[:, [0, 2, 1]], mesh.triangles).astype(np.int32)
    if mesh.polygons is None or len(mesh.polygons.triangulate()) != mesh.n_triangles:
        return TriangleMesh(mesh.vertices, triangles)
    counts, indices = mesh.polygons.counts, mesh.polygons.indices
    face_start = np.cumsum(counts - 2) - (counts - 2)
    starts = np.repeat(np.cumsum(counts) - counts, counts)
    place = np.arange(len(indices)) - starts
    # The first corner stays, so that the fan is the same set of triangles.
    mirrored = starts + np.where(place == 0, 0, np.repeat(counts, counts) - place)
    turned = np.repeat(np.logical_or.reduceat(flips, face_start), counts)
    polygons = Polygons(counts, np.where(turned, indices[mirrored], indices).astype(np.int32))
    return TriangleMesh(mesh.vertices, polygons.triangulate(), polygons)


def _faces(mask: NDArray[np.bool_]) -> str:
    count = int(np.count_nonzero(mask))
    return f"{count} face{'s' if count > 1 else ''}"


def said(repair: Repair, where: object) -> Repair:
    """The same, with its notes in the log."""
    for note in repair.notes:
        logger.warning("%s%s", f"{where}: " if str(where) else "", note)
    return repair
