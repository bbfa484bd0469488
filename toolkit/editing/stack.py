"""The stack of edits: each is solved on what those before it left, and kept: only what changed is solved again.

A layer is known by what led to it: the kinds and data of the edits up to it. Switching an edit off and on, undo and
redo find their layers again; changing the last edit solves that one alone.
"""

from __future__ import annotations

import json
import logging
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit import DetailChange, DetailEdit
from toolkit.details import Reconstruction
from toolkit.editing.opening import OpenedTake
from toolkit.editing.visible import CoatingOffsets
from toolkit.errors import InputError
from toolkit.pose_edit import (
    Constraint,
    EditableTake,
    EditParameters,
    PoseEdit,
    PoseEditor,
    Residual,
    VisibleDetails,
    from_data,
)
from toolkit.progress import Progress, silent
from toolkit.shot.journal import Edit

__all__ = ["EditStack", "Layer", "State"]

log = logging.getLogger(__name__)

_MOST_LAYERS = 64

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class State:
    """The take after some edits: ``take`` with their bases and weights, ``changes`` of the details."""

    opened: OpenedTake
    take: EditableTake
    changes: tuple[DetailChange, ...] = ()

    @cached_property
    def reconstruction(self) -> Reconstruction:
        """What builds its frames."""
        return self.opened.reconstruction.edited(self.take.weights, self.take.edits, self.changes)

    def frame(self, t: int) -> NDArray[np.float32]:
        """One frame (V, 3) of the result."""
        out = np.empty((1, self.take.n_vertices, 3), dtype=np.float32)
        self.reconstruction.frames(t, t + 1, np.ascontiguousarray(self.opened.details[t : t + 1]), out)
        return out[0]

    def touches(self, t: int) -> bool:
        """Whether any edit changes frame t."""
        weights = self.take.weights[t]
        return bool(
            (weights != self.opened.take.weights[t]).any()
            or any(np.einsum("k,ukc->uc", weights, edit.coefficients).any() for edit in self.take.edits)
            or any(change.touches(t) for change in self.changes)
        )


@dataclass(frozen=True, eq=False)
class Layer:
    """The state after an edit; ``solved`` is the solver's result, ``problem`` why the edit could not be applied."""

    edit: Edit
    state: State
    residuals: tuple[Residual, ...] = ()
    solved: PoseEdit | DetailChange | None = None
    problem: str | None = None


class EditStack:
    """Solves stacks of edits on one opened take."""

    def __init__(self, opened: OpenedTake, triangles: NDArray[np.integer]) -> None:
        self.opened = opened
        offsets = VisibleDetails(opened.target, opened.details, opened.gain)
        self._offsets = offsets
        self.base = self._seen(State(opened, opened.take))
        self._editor = PoseEditor(self.base.take, triangles)
        self._editor.prepare(EditParameters())
        self._layers: OrderedDict[tuple[str, ...], Layer] = OrderedDict()
        # Details live in local frames: what an edit of theirs does depends on no pose.
        self._changes: OrderedDict[tuple[str, ...], DetailChange] = OrderedDict()

    def layers(self, edits: Sequence[Edit], progress: Progress = silent, *, strict: bool = False) -> list[Layer]:
        """One layer for each edit, in order. An edit that cannot be applied is passed over, or with ``strict`` raised.

        An exception from ``progress`` cancels and leaves everything as it was.
        """
        found: list[Layer] = []
        key: tuple[str, ...] = ()
        details: tuple[str, ...] = ()
        for edit in edits:
            word = json.dumps([edit.kind, _without_note(edit.data)], sort_keys=True)
            key = (*key, word)
            details = (*details, word) if edit.kind == "detail" else details
            layer = self._layers.get(key)
            if layer is None or (strict and layer.problem is not None):
                layer = self._solve(edit, found[-1].state if found else self.base, details, progress, strict)
            _keep(self._layers, key, layer)
            found.append(replace(layer, edit=edit))
        return found

    def solve_pose(
        self,
        state: State,
        constraints: Sequence[Constraint],
        parameters: EditParameters,
        *,
        warm: bool = False,
        progress: Progress = silent,
    ) -> PoseEdit:
        """Solve a pose edit on a state; constraints and residuals are in the result's place."""
        if self._editor.take is not state.take:
            self._editor = self._editor.following(state.take)
        placement = self.opened.placement
        edit = self._editor.solve(placement.to_bases(constraints), parameters, warm=warm, progress=progress)
        residuals = tuple(placement.residual(c, r) for c, r in zip(constraints, edit.residuals, strict=True))
        return replace(edit, residuals=residuals)

    def after_pose(self, state: State, edit: PoseEdit) -> State:
        """The state after a pose edit."""
        return self._seen(State(self.opened, edit.take, state.changes))

    def solve_detail(self, state: State, edit: DetailEdit | Mapping[str, Any]) -> DetailChange:
        """Solve a detail edit on a state, given as such or as in the journal."""
        return self.opened.detail_solver.solve(edit, state.changes)

    def after_detail(self, state: State, change: DetailChange) -> State:
        """The state after a detail edit."""
        return self._seen(State(self.opened, state.take, (*state.changes, change)))

    def _solve(self, edit: Edit, state: State, details: tuple[str, ...], progress: Progress, strict: bool) -> Layer:
        """``details`` tells the detail edits up to this one."""
        try:
            if edit.kind == "pose":
                constraints, parameters = from_data(edit.data)
                solved = self.solve_pose(state, constraints, parameters, progress=progress)
                return Layer(edit, self.after_pose(state, solved), solved.residuals, solved)
            if edit.kind == "detail":
                change = self._changes.get(details) or self.solve_detail(state, edit.data)
                _keep(self._changes, details, change)
                return Layer(edit, self.after_detail(state, change), (), change)
            raise InputError(f'an edit of the kind "{edit.kind}" is unknown', remedy="a newer version may have made it")
        except InputError as error:
            if strict:
                raise
            log.warning("edit %d is passed over: %s", edit.number, error)
            return Layer(edit, state, problem=str(error))

    def _seen(self, state: State) -> State:
        """The state with what details add there, so that constraints are about what the user sees."""
        offsets = self._offsets.changed(state.changes) if state.changes else self._offsets
        if not self.opened.by_coating:
            return replace(state, take=replace(state.take, detail_offset=offsets))
        return replace(
            state, take=replace(state.take, detail_offset=CoatingOffsets(state.reconstruction, self.opened.details))
        )


def _keep(kept: OrderedDict[tuple[str, ...], T], key: tuple[str, ...], value: T) -> None:
    kept[key] = value
    kept.move_to_end(key)
    while len(kept) > _MOST_LAYERS:
        kept.popitem(last=False)


def _without_note(data: dict[str, Any]) -> dict[str, Any]:
    """An edit's data without the user's note on it, which changes nothing."""
    return {name: value for name, value in data.items() if name != "note"}
