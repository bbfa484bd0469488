"""What the user asks of single frames: points, distances, and what must stay.

All three are about the surface that the user sees, details included, in the pose and size in which the bases live (the
source's, before the head's motion and the target's own size are put back).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.pose_edit.take import EditableTake

__all__ = [
    "BeyondConstraint",
    "Constraint",
    "ConstraintRows",
    "DistanceConstraint",
    "FixedConstraint",
    "PointConstraint",
    "check_ids",
    "handled_vertices",
    "rows_of",
]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Vector = tuple[float, float, float]

# Each vertex fixed in single frames costs a back-substitution; those fixed in all frames cost nothing.
_MOST_FIXED = 400


@dataclass(frozen=True)
class PointConstraint:
    """A vertex goes to a ``place``, or moves by an ``offset`` from where it is, in one frame (Eq. 14)."""

    frame: int
    vertex: int
    place: Vector | None = None
    offset: Vector | None = None
    weight: float = 1.0

    def __post_init__(self) -> None:
        _check_whole((self.frame, self.vertex))
        if (self.place is None) == (self.offset is None):
            raise InputError(f"the point constraint on vertex {self.vertex} needs either a place or an offset")
        given = np.asarray(self.place if self.place is not None else self.offset, dtype=np.float64)
        if given.shape != (3,) or not np.isfinite(given).all():
            raise InputError(f"the point constraint on vertex {self.vertex} asks for {given}, which is no place")
        _check_weight(self.weight)


@dataclass(frozen=True)
class DistanceConstraint:
    """Two vertices get a new ``length`` between them, or ``factor`` times the present one, in one frame (Eq. 15).

    The direction from one to the other stays that of the unedited frame.
    """

    frame: int
    vertices: tuple[int, int]
    length: float | None = None
    factor: float | None = None
    weight: float = 1.0

    def __post_init__(self) -> None:
        _check_whole((self.frame, *self.vertices))
        given = self.length if self.length is not None else self.factor
        if (self.length is None) == (self.factor is None) or given is None:
            raise InputError(f"the distance constraint on vertices {self.vertices} needs either a length or a factor")
        if not np.isfinite(given) or given < 0 or len(self.vertices) != 2 or self.vertices[0] == self.vertices[1]:
            raise InputError(
                f"a distance of {given} between vertices {self.vertices} cannot be had",
                remedy="give two different vertices and a length or factor that is not negative",
            )
        _check_weight(self.weight)


@dataclass(frozen=True)
class FixedConstraint:
    """Vertices that stay where they are: in every frame (``frames`` None), or in the given ones.

    Fixed in every frame, they are held exactly in the bases, at no cost however many they are, and the weights are kept
    from moving them within the window. Fixed in some frames, each is a point constraint at its present place.
    """

    vertices: tuple[int, ...]
    frames: tuple[int, ...] | None = None
    weight: float = 1.0

    def __post_init__(self) -> None:
        _check_whole((*self.vertices, *(self.frames or ())))
        if self.frames is not None and len(self.vertices) * len(self.frames) > _MOST_FIXED:
            raise InputError(
                f"{len(self.vertices)} vertices in {len(self.frames)} frames are too many to fix one by one",
                remedy=f"fix them in all frames, or choose at most {_MOST_FIXED} in all",
            )
        _check_weight(self.weight)


@dataclass(frozen=True)
class BeyondConstraint:
    """Everything farther than ``distance`` from some ``vertices`` stays where it is, in every frame.

    Without vertices, from all that the edit's points and distances take hold of. `toolkit.pose_edit.regions` says how
    it is measured; the solver turns it into a `FixedConstraint`.
    """

    distance: float
    vertices: tuple[int, ...] = ()
    weight: float = 1.0

    def __post_init__(self) -> None:
        _check_whole(self.vertices)
        if not np.isfinite(self.distance) or self.distance <= 0:
            raise InputError(f"a distance of {self.distance} makes no region", remedy="give a positive number")
        _check_weight(self.weight)


Constraint = PointConstraint | DistanceConstraint | FixedConstraint | BeyondConstraint


def handled_vertices(constraints: Sequence[Constraint]) -> list[int]:
    """The vertices that points and distances take hold of."""
    found: list[int] = []
    for constraint in constraints:
        if isinstance(constraint, PointConstraint):
            found.append(constraint.vertex)
        elif isinstance(constraint, DistanceConstraint):
            found += constraint.vertices
    return found


@dataclass(frozen=True)
class ConstraintRows:
    """All constraints as rows on displacements of the smoothed surface.

    Row a asks ``sum_u combination[a, u] x_(vertices[u]) = goals[a]`` in frame ``frames[a]``, ``x`` the displacement
    from rest, with ``weights[a]``; it belongs to constraint ``owners[a]``. ``held`` (H,) are the vertices fixed in all
    frames, ``held_weight`` their weight.
    """

    frames: Ids
    vertices: Ids
    combination: Array
    goals: Array
    weights: Array
    owners: Ids
    held: Ids
    held_weight: float

    def __len__(self) -> int:
        return len(self.frames)


def rows_of(constraints: Sequence[Constraint], take: EditableTake) -> ConstraintRows:
    """The constraints' rows ``(R,)``; goals are what the user sees less the details of that frame."""
    rows: list[_Row] = []
    held, held_weight = np.zeros(0, dtype=np.int64), 0.0
    for owner, constraint in enumerate(constraints):
        if isinstance(constraint, FixedConstraint):
            check_ids(constraint.vertices, take.n_vertices, "vertex")
            if constraint.frames is None:
                held = np.union1d(held, np.asarray(constraint.vertices, dtype=np.int64))
                held_weight = max(held_weight, constraint.weight)
                continue
            for frame in constraint.frames:
                for vertex in constraint.vertices:
                    stay = PointConstraint(frame, vertex, offset=(0.0, 0.0, 0.0), weight=constraint.weight)
                    rows.append(_point_row(stay, take, owner))
        elif isinstance(constraint, PointConstraint):
            rows.append(_point_row(constraint, take, owner))
        elif isinstance(constraint, BeyondConstraint):
            raise TypeError("a BeyondConstraint has to be turned into a FixedConstraint first")
        else:
            rows.append(_distance_row(constraint, take, owner))
    vertices = np.array(sorted({v for row in rows for v in row.parts}), dtype=np.int64)
    combination = np.zeros((len(rows), len(vertices)))
    for a, row in enumerate(rows):
        for vertex, value in row.parts.items():
            combination[a, np.searchsorted(vertices, vertex)] += value
    return ConstraintRows(
        frames=np.array([row.frame for row in rows], dtype=np.int64),
        vertices=vertices,
        combination=combination,
        goals=np.array([row.goal for row in rows]).reshape(-1, 3),
        weights=np.array([row.weight for row in rows]),
        owners=np.array([row.owner for row in rows], dtype=np.int64),
        held=held,
        held_weight=held_weight,
    )


class _Row(NamedTuple):
    frame: int
    parts: dict[int, float]
    goal: Array
    weight: float
    owner: int


def _point_row(constraint: PointConstraint, take: EditableTake, owner: int) -> _Row:
    frame, vertex = constraint.frame, constraint.vertex
    check_ids([frame], take.n_frames, "frame")
    check_ids([vertex], take.n_vertices, "vertex")
    if constraint.offset is not None:
        goal = take.displacements_at(frame, [vertex])[0] + np.asarray(constraint.offset, dtype=np.float64)
    else:
        place = np.asarray(constraint.place, dtype=np.float64)
        goal = place - take.detail_at(frame, [vertex])[0] - take.rest[vertex]
    return _Row(frame, {vertex: 1.0}, goal, constraint.weight, owner)


def _distance_row(constraint: DistanceConstraint, take: EditableTake, owner: int) -> _Row:
    frame, ids = constraint.frame, list(constraint.vertices)
    check_ids([frame], take.n_frames, "frame")
    check_ids(ids, take.n_vertices, "vertex")
    detail = take.detail_at(frame, ids)
    seen = take.rest[ids] + take.displacements_at(frame, ids) + detail
    apart = seen[0] - seen[1]
    present = float(np.sqrt(apart @ apart))
    if present == 0:
        raise InputError(
            f"vertices {ids} touch in frame {frame}, so there is no direction to draw them apart",
            remedy="use point constraints",
        )
    length = constraint.length if constraint.length is not None else (constraint.factor or 0.0) * present
    goal = apart * (length / present) - (detail[0] - detail[1]) - (take.rest[ids[0]] - take.rest[ids[1]])
    return _Row(frame, {ids[0]: 1.0, ids[1]: -1.0}, goal, constraint.weight, owner)


def _check_whole(ids: Sequence[int]) -> None:
    if len(ids) and np.asarray(ids).dtype.kind not in "iu":
        wrong = next(value for value in ids if not isinstance(value, int | np.integer))
        raise InputError(f"{wrong!r} is no number of a frame or vertex", remedy="give whole numbers from 0 on")


def _check_weight(weight: float) -> None:
    if not np.isfinite(weight) or weight <= 0:
        raise InputError(f"a constraint's weight of {weight} makes no sense", remedy="give a positive number")


def check_ids(ids: Sequence[int] | Ids, count: int, what: str) -> None:
    """Raise InputError where an id is not from 0 to ``count - 1``; ``what`` says of what."""
    array = np.asarray(ids)
    wrong = array[(array < 0) | (array >= count)]
    if len(wrong):
        raise InputError(f"there is no {what} {wrong[0]}: they go from 0 to {count - 1}")
