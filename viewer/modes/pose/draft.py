"""A pose edit while it is made: plain values that never change, so that undo is a list of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.pose_edit import (
    BeyondConstraint,
    Constraint,
    DistanceConstraint,
    EditParameters,
    FixedConstraint,
    PointConstraint,
    from_data,
    to_data,
)

__all__ = ["Handle", "PoseDraft", "goal_of"]

Array = NDArray[np.float64]
Handle = PointConstraint | DistanceConstraint


@dataclass(frozen=True)
class PoseDraft:
    """What the user has asked for so far.

    ``handles`` the points and distances, in the order of making; ``fixed`` vertices held in all frames; ``beyond``
    holds everything farther than this, in the target's unit; ``others`` constraints of an opened edit that have no
    gesture, kept as they are. ``instead_of`` is the number of the committed edit that is changed.
    """

    handles: tuple[Handle, ...] = ()
    fixed: tuple[int, ...] = ()
    beyond: float | None = None
    others: tuple[Constraint, ...] = ()
    parameters: EditParameters = field(default_factory=EditParameters)
    note: str = ""
    instead_of: int | None = None

    @property
    def empty(self) -> bool:
        """Whether nothing is moved: there is nothing to solve."""
        return not self.handles and not any(not isinstance(one, BeyondConstraint) for one in self.others)

    @property
    def frames(self) -> list[int]:
        """The frames in which something is asked for."""
        return sorted({handle.frame for handle in self.handles})

    @property
    def highest(self) -> tuple[int, int, int]:
        """The highest frame, vertex and triangle that it names."""
        frames, vertices = [-1, *self.frames, *(self.window or ())], [-1, *self.fixed]
        for handle in self.handles:
            vertices += [handle.vertex] if isinstance(handle, PointConstraint) else list(handle.vertices)
        return max(frames), max(vertices), -1

    @property
    def window(self) -> tuple[int, int] | None:
        """The frames whose weights may change; None all."""
        return self.parameters.window

    def constraints(self) -> list[Constraint]:
        """For the solver: first the handles, one for one, then what is held."""
        held: list[Constraint] = []
        if self.fixed:
            held.append(FixedConstraint(self.fixed))
        if self.beyond is not None and self.handles:
            held.append(BeyondConstraint(self.beyond))
        return [*self.handles, *held, *self.others]

    def with_handle(self, handle: Handle, index: int | None = None) -> PoseDraft:
        """With one more, or with another in the place of number ``index``."""
        listed = list(self.handles)
        if index is None:
            listed.append(handle)
        else:
            listed[index] = handle
        return replace(self, handles=tuple(listed))

    def without(self, index: int) -> PoseDraft:
        """With one handle less."""
        return replace(self, handles=self.handles[:index] + self.handles[index + 1 :])

    def find(self, frame: int, vertex: int) -> int:
        """The point on a vertex in a frame, or -1."""
        for index, handle in enumerate(self.handles):
            if isinstance(handle, PointConstraint) and (handle.frame, handle.vertex) == (frame, vertex):
                return index
        return -1

    def changed(self, **parameters: Any) -> PoseDraft:
        """With other parameters."""
        return replace(self, parameters=replace(self.parameters, **parameters))

    def data(self) -> dict[str, Any]:
        """As the journal holds it."""
        return to_data(self.constraints(), self.parameters) | ({"note": self.note} if self.note else {})

    def to_data(self) -> dict[str, Any]:
        """Everything, also what the journal does not need."""
        return {**self.data(), "beyond": self.beyond, "instead_of": self.instead_of}

    @classmethod
    def from_data(cls, data: Mapping[str, Any], instead_of: int | None = None) -> PoseDraft:
        """The reverse of `data` and of `to_data`; InputError for what is no edit."""
        values = dict(data)
        beyond, number = values.pop("beyond", None), values.pop("instead_of", instead_of)
        note = str(values.pop("note", ""))
        constraints, parameters = from_data(values)
        handles = tuple(one for one in constraints if isinstance(one, Handle))
        fixed: tuple[int, ...] = ()
        others: list[Constraint] = []
        for one in constraints:
            if isinstance(one, FixedConstraint) and one.frames is None and one.weight == 1:
                fixed += one.vertices
            elif isinstance(one, BeyondConstraint) and not one.vertices and one.weight == 1:
                beyond = one.distance
            elif not isinstance(one, Handle):
                others.append(one)
        fixed = tuple(sorted({int(vertex) for vertex in fixed}))
        return cls(handles, fixed, beyond, tuple(others), parameters, note, number)


def goal_of(point: PointConstraint, start: Array) -> Array:
    """Where a point is to go, ``(3,)``; ``start`` where it is without the edit."""
    if point.place is not None:
        return np.asarray(point.place, dtype=np.float64)
    return np.asarray(start + np.asarray(point.offset, dtype=np.float64))
