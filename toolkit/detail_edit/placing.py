"""Where the details of a paste or of a reshaped wrinkle come from and go to (the paper's section 5.2, Eq. 17)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.detail_edit.bend import bent_along
from toolkit.detail_edit.carry import Carrier, carrier
from toolkit.detail_edit.edits import PasteEdit, ReshapeEdit
from toolkit.detail_edit.flatten import FlatPatch, flattened, minimal_turn
from toolkit.detail_edit.region import Region
from toolkit.detail_edit.surface import Surface, SurfacePoint
from toolkit.detail_edit.take import DetailTake
from toolkit.errors import InputError

__all__ = ["paste_carrier", "reshape_carrier"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Ids = NDArray[np.int64]

_MARGIN = 4.0
"""How far patches reach beyond what is needed, in edge lengths: every vertex in use must have its neighbours."""


def paste_carrier(edit: PasteEdit, region: Region, take: DetailTake, source: DetailTake) -> Carrier:
    """The map of a paste; ``region`` is the edit's with its band, on the ``source`` take."""
    start = _axes_at(source, edit.start)
    goal, axes = _goal(edit, take, source, start)
    margin = _MARGIN * source.surface.edge(region.vertices)
    here = _patch(source, _near(source.surface, region, margin), edit.start, start)
    if here is None or not np.isin(region.vertices, here.vertices).any():
        raise InputError(
            "the point that the paste starts from does not lie in the region, or not on the same part of the face",
            remedy="choose a start inside the region",
        )
    lost = ~np.isin(region.vertices, here.vertices)
    inside = Region(region.vertices[~lost], region.weights[~lost])
    held = np.searchsorted(here.vertices, inside.vertices)
    size = edit.scale * _unit(take) / _unit(source) if source is not take else edit.scale
    turn = size * np.exp(1j * np.radians(edit.rotation))
    bent = turn * (here.places.conj() if edit.mirror else here.places)
    reach = float(np.abs(bent[held]).max())
    reach = 1.15 * reach + _MARGIN * take.surface.edge()
    around = np.flatnonzero(np.isfinite(take.surface.distance([goal], reach)))
    there = _patch(take, around, goal, axes)
    if there is None:
        raise InputError("there is no skin round the point that the paste goes to", remedy="choose another goal")
    return carrier(here, bent, inside, there, (source.neighbour, take.neighbour), size * edit.strength, edit.mirror)


def reshape_carrier(edit: ReshapeEdit, region: Region, take: DetailTake) -> Carrier:
    """The map of a reshaped wrinkle; ``region`` is the edit's with its band.

    Both lie on one patch of the skin, laid flat; there the region is bent (`bent_along`).
    """
    surface = take.surface
    surface.check_triangles(np.concatenate([edit.curve.triangles, edit.goal.triangles]))
    flat = _reshape_patch(edit, region, take)
    start, end = (flat.at(line.triangles, line.weights, surface) for line in (edit.curve, edit.goal))
    if np.isnan(start).any() or np.isnan(end).any():
        raise InputError(
            "the two curves do not lie on one part of the face that hangs together", remedy="draw them closer together"
        )
    if abs(start[0] - end[0]) + abs(start[-1] - end[-1]) > abs(start[0] - end[-1]) + abs(start[-1] - end[0]):
        end = end[::-1]  # a wrinkle has no direction, and people draw from either side
    bent = bent_along(flat, region, start, end, edit.stiffness)
    return carrier(flat, bent, region, flat, (take.neighbour, take.neighbour), 1.0)


def _goal(edit: PasteEdit, take: DetailTake, source: DetailTake, start: Array) -> tuple[SurfacePoint, Array]:
    """Where the start goes, and the axes ``(3, 3)`` there that the source's are carried to."""
    goal = edit.goal if edit.goal is not None else edit.start
    if edit.mirror:
        mirror = take.mirror
        if edit.goal is None:
            goal = mirror.across(edit.start)
        # The plane's axes are mirrored with the skin; the imaginary one turns round with the patch (`paste_carrier`).
        start = start @ mirror.reflection.T
    take.surface.check_triangles(np.array([goal.triangle]))
    normal = _axes_at(take, goal)[2]
    first = minimal_turn(start[2], normal) @ start[0]
    first -= (first @ normal) * normal
    first /= np.linalg.norm(first)
    return goal, np.stack([first, np.cross(normal, first), normal])


def _axes_at(take: DetailTake, point: SurfacePoint) -> Array:
    """Tangent, bitangent and normal at a point, ``(3, 3)`` rows."""
    take.surface.check_triangles(np.array([point.triangle]))
    corners = take.surface.triangles[point.triangle]
    frames = take.frames0[corners]
    normal = np.array(point.weights) @ frames[:, :, 2]
    normal /= np.linalg.norm(normal)
    first = frames[int(np.argmax(point.weights)), :, 0]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal])


def _patch(take: DetailTake, vertices: Ids, centre: SurfacePoint, axes: Array) -> FlatPatch | None:
    """A patch laid flat; kept, since the same is asked for while a paste is being turned or a goal curve drawn."""
    key = ("patch", vertices.tobytes(), centre, axes.tobytes())
    corners = take.surface.triangles[centre.triangle]
    flat: FlatPatch | None = take.shared.get(
        key, lambda: flattened(take.surface, vertices, corners, np.array(centre.weights), axes)
    )
    return flat


def _near(surface: Surface, region: Region, margin: float) -> Ids:
    distance = surface.distance_from_vertices(region.vertices, margin)
    return np.flatnonzero(np.isfinite(distance))


def _reshape_patch(edit: ReshapeEdit, region: Region, take: DetailTake) -> FlatPatch:
    """All that lies no farther from the wrinkle than the goal and the region do, and a margin."""
    surface = take.surface
    margin = _MARGIN * surface.edge(region.vertices)
    needed = np.union1d(region.vertices, surface.triangles[edit.goal.triangles])
    straight = cKDTree(surface.places(edit.curve)).query(surface.vertices[needed])[0]
    for limit in (1.5 * float(straight.max()) + 2 * margin, np.inf):
        gap = surface.distance(edit.curve, limit)
        farthest = float(gap[needed].max())
        if farthest + margin <= limit:
            break
    if not np.isfinite(farthest):
        raise InputError(
            "the region and the two curves do not lie on one part of the face that hangs together",
            remedy="draw both lines on the skin that the region is on",
        )
    centre = edit.curve.point(len(edit.curve) // 2)
    flat = _patch(take, np.flatnonzero(gap <= farthest + margin), centre, _axes_at(take, centre))
    if flat is None:
        raise InputError("there is no skin round the wrinkle's curve", remedy="draw the line on the skin")
    return flat


def _unit(take: DetailTake) -> float:
    return float(np.sqrt(np.mean(np.var(take.smooth, axis=0))))
