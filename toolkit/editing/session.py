"""A shot opened for editing: what the viewer and scripts/6_edit.py call."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit import DetailChange, DetailEdit, DetailTake
from toolkit.detail_edit import to_data as detail_data
from toolkit.editing.applied import applied
from toolkit.editing.drafts import Draft, plain_data
from toolkit.editing.moved import moved_by
from toolkit.editing.opening import open_take
from toolkit.editing.stack import EditStack, Layer, State
from toolkit.editing.words import step_in_words
from toolkit.errors import InputError
from toolkit.pose_edit import Constraint, EditParameters, PoseEdit, Residual
from toolkit.pose_edit import to_data as pose_data
from toolkit.progress import Progress, silent
from toolkit.shot import Shot
from toolkit.shot.journal import Edit, Journal, Step
from toolkit.stages import current_key, result, stage_parameters
from toolkit.stages.inputs import load_sequence

__all__ = ["EditSession"]

Array = NDArray[np.float64]


class EditSession:
    """Edits of one shot: drafts while a pointer moves, a journal of what was committed, and frames with all of it.

    Everything is in the *result's place*: the target's unit and place, the head's motion in it, as the user sees it.
    Frames and vertices are numbered from 0, vertices on the source's topology. All calls may come from any thread;
    one lock lets them through one at a time.
    """

    def __init__(self, shot: Shot, stack: EditStack, triangles: NDArray[np.int32], progress: Progress = silent) -> None:
        self.shot, self.triangles = shot, triangles
        self._stack, self._journal = stack, Journal(shot.edits_path)
        self._lock = threading.RLock()
        self._sequence = load_sequence(shot)
        self.fps = float(self._sequence.fps or 30.0)
        self.rest: Array = np.array(shot.array("register", "target_vertices"))
        self._draft: Draft | None = None
        self._moved: tuple[State, Array] | None = None
        self._refresh(progress)

    @classmethod
    def open(cls, shot: Shot, progress: Progress = silent) -> EditSession:
        """Open a shot whose stages up to "transfer" are up to date; InputError says so where they are not.

        Takes a few seconds: the matrix of edits is factorised, and those of the journal are solved. An edit that
        cannot be applied is left out with a warning; `problem` tells why.
        """
        opened = open_take(shot, progress)
        triangles = np.array(shot.array("inputs", "source_triangles"))
        return cls(shot, EditStack(opened, triangles), triangles, progress)

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return self._stack.base.take.n_frames

    @property
    def n_vertices(self) -> int:
        """Number of vertices V."""
        return self._stack.base.take.n_vertices

    @property
    def n_bases(self) -> int:
        """Number of bases K."""
        return self._stack.base.take.n_bases

    @property
    def weights(self) -> Array:
        """The unedited weights, (T, K)."""
        return self._stack.base.take.weights

    @property
    def edited_weights(self) -> Array:
        """The weights with all active edits, and the draft, (T, K)."""
        with self._lock:
            return self._state.take.weights

    def source_frame(self, t: int) -> NDArray[np.float32]:
        """Frame t of the take as it was given, (V, 3)."""
        self._check_frame(t)
        with self._lock:
            return np.asarray(self._sequence.read(t, t + 1)[0], dtype=np.float32)

    def unedited_frame(self, t: int) -> NDArray[np.float32]:
        """Frame t of the automatic result, (V, 3)."""
        self._check_frame(t)
        with self._lock:
            return self._stack.base.frame(t)

    def frame(self, t: int) -> NDArray[np.float32]:
        """Frame t with every active edit and the draft, (V, 3); bit for bit the unedited one where nothing acts."""
        self._check_frame(t)
        with self._lock:
            return self._state.frame(t)

    @property
    def edits(self) -> tuple[Edit, ...]:
        """All edits in the order in which they act, switched off ones too."""
        with self._lock:
            return self._replay.edits

    @property
    def can_undo(self) -> str | None:
        """What undo would take back, in words for a button; None if there is nothing."""
        with self._lock:
            return step_in_words(self._replay.undo, self._kinds)

    @property
    def can_redo(self) -> str | None:
        """What redo would do again."""
        with self._lock:
            return step_in_words(self._replay.redo, self._kinds)

    @property
    def state(self) -> State:
        """What builds frames with every active edit and the draft. It never changes, so it needs no lock later."""
        with self._lock:
            return self._state

    @property
    def unedited_state(self) -> State:
        """What builds frames of the automatic result."""
        return self._stack.base

    def committed_state(self, without: int | None = None) -> State:
        """What builds frames with the committed edits, or with all of them but one: what a draft starts from."""
        with self._lock:
            return self._without(without)

    @property
    def has_draft(self) -> bool:
        """Whether a draft is open."""
        with self._lock:
            return self._draft is not None

    def draft_pose(
        self,
        constraints: Sequence[Constraint],
        parameters: EditParameters | None = None,
        *,
        warm: bool = True,
        instead_of: int | None = None,
        progress: Progress = silent,
    ) -> PoseEdit:
        """Try a pose edit on top of the committed ones: `frame` shows it, nothing is written.

        It takes the place of an open draft. ``warm`` begins from the last draft's solution, for dragging. The residuals
        are in the result's unit. An error or a cancel leaves the draft that was. ``instead_of`` tries a change of a
        committed edit: it is left out of those below, and `commit` changes it in its place.
        """
        parameters = parameters or EditParameters()
        with self._lock:
            data = plain_data(pose_data(constraints, parameters))
            base = self._without(instead_of)
            solved = self._stack.solve_pose(base, constraints, parameters, warm=warm, progress=progress)
            self._draft = Draft("pose", data, self._stack.after_pose(base, solved), instead_of)
            return solved

    def draft_detail(self, edit: DetailEdit, *, instead_of: int | None = None) -> DetailChange:
        """Try a detail edit (`toolkit.detail_edit`) on top of the committed ones, as `draft_pose`."""
        with self._lock:
            base = self._without(instead_of)
            change = self._stack.solve_detail(base, edit)
            state = self._stack.after_detail(base, change)
            self._draft = Draft("detail", plain_data(detail_data(edit)), state, instead_of)
            return change

    @property
    def detail_take(self) -> DetailTake:
        """The details with all committed edits, to select and to measure on; in the pose and size of the bases."""
        with self._lock:
            return self._stack.opened.detail_solver.take.changed(*self._committed.changes)

    def in_pose_of_bases(self, length: float) -> float:
        """A length of the result's unit as one of `detail_take`'s."""
        return length / self._stack.opened.placement.scale

    def drop_draft(self) -> None:
        """Forget the draft."""
        with self._lock:
            self._draft = None

    def commit(self, note: str = "", progress: Progress = silent) -> Edit:
        """Make the draft an edit: solved cold, so that it is the same on every machine, and on disk when this returns.

        An error or a cancel leaves the draft and the journal as they were.
        """
        with self._lock:
            if self._draft is None:
                raise InputError("there is no draft to commit", remedy="make one with draft_pose or draft_detail")
            draft = self._draft
            data = draft.data | ({"note": note} if note else {})
            if draft.instead_of is None:
                return self.add(draft.kind, data, progress)
            self.change(draft.instead_of, data, progress)
            return next(edit for edit in self._replay.edits if edit.number == draft.instead_of)

    def add(self, kind: str, data: dict[str, Any], progress: Progress = silent) -> Edit:
        """Commit an edit given as data, as the journal holds it: ``kind`` "pose" or "detail"; drops the draft."""
        with self._lock:
            data = plain_data(data)
            self._stack.layers([*self._replay.active, Edit(-1, kind, data)], progress, strict=True)
            edit = self._journal.add(kind, data)
            self._refresh()
            return edit

    def change(self, number: int, data: dict[str, Any], progress: Progress = silent) -> None:
        """Give an edit new data; those after it are solved again on top of it. Drops the draft."""
        with self._lock:
            data = plain_data(data)
            edits = [replace(edit, data=data) if edit.number == number else edit for edit in self._replay.edits]
            changed = [edit for edit in edits if edit.number == number]
            if changed:  # else the journal says what is wrong
                before = [edit for edit in edits if edit.on and edit.number < number]
                self._stack.layers([*before, replace(changed[0], on=True)], progress, strict=True)
            self._journal.change(number, data)
            self._refresh()

    def switch(self, number: int, on: bool) -> None:
        """Switch an edit off or on; drops the draft."""
        with self._lock:
            self._journal.switch(number, on)
            self._refresh()

    def remove(self, number: int) -> None:
        """Take an edit away; undo brings it back. Drops the draft."""
        with self._lock:
            self._journal.remove(number)
            self._refresh()

    def undo(self) -> Step | None:
        """Take back the last step of any kind, also one from before a restart; drops the draft."""
        with self._lock:
            step = self._journal.undo()
            self._refresh()
            return step

    def redo(self) -> Step | None:
        """Do the step again that was undone last; drops the draft."""
        with self._lock:
            step = self._journal.redo()
            self._refresh()
            return step

    def reload(self) -> None:
        """Take in what another process has written to the journal; drops the draft."""
        with self._lock:
            self._refresh()

    def edited_frames(self) -> Array:
        """How far each frame moved at most, in the result's unit, ``(T,)``: seen at some thousand vertices."""
        with self._lock:
            if self._moved is None or self._moved[0] is not self._state:
                self._moved = (self._state, moved_by(self._state))
            return self._moved[1]

    def residuals(self, number: int) -> tuple[Residual, ...]:
        """How far each constraint of an active pose edit is from being met, in the result's unit."""
        layer = self._layer(number)
        return layer.residuals if layer is not None else ()

    def problem(self, number: int) -> str | None:
        """Why an edit could not be applied, or None."""
        layer = self._layer(number)
        return layer.problem if layer is not None else None

    def solved(self, number: int) -> PoseEdit | DetailChange | None:
        """What the solver found for an active edit."""
        layer = self._layer(number)
        return layer.solved if layer is not None else None

    def write_result(self, progress: Progress = silent) -> None:
        """Write the stage "result" with the committed edits, if it is not up to date already."""
        with self._lock:
            self._follow()
            key = current_key(self.shot, "result")
            if self.shot.is_current("result", key):
                return
            edits = applied(self.shot, self._stack, self._layers)
            with self.shot.write_stage("result", key, stage_parameters(self.shot, "result")) as folder:
                result.work(self.shot, folder, progress, edits=edits)

    @property
    def _state(self) -> State:
        return self._draft.state if self._draft is not None else self._committed

    def _without(self, number: int | None) -> State:
        if number is None:
            return self._committed
        others = self._stack.layers([edit for edit in self._replay.active if edit.number != number])
        return others[-1].state if others else self._stack.base

    def _layer(self, number: int) -> Layer | None:
        with self._lock:
            if all(edit.number != number for edit in self._replay.edits):
                raise InputError(f"there is no edit {number}", where=self._journal.path)
            return next((layer for layer in self._layers if layer.edit.number == number), None)

    def _refresh(self, progress: Progress = silent) -> None:
        """Follow the journal and drop the draft."""
        self._follow(progress)
        self._draft = None

    def _follow(self, progress: Progress = silent) -> None:
        self._replay = self._journal.replay()
        self._kinds = {edit.number: edit.kind for edit in self._replay.edits}
        self._layers = self._stack.layers(self._replay.active, progress)
        self._committed = self._layers[-1].state if self._layers else self._stack.base

    def _check_frame(self, t: int) -> None:
        if not 0 <= t < self.n_frames:
            raise InputError(f"there is no frame {t}", remedy=f"frames go from 0 to {self.n_frames - 1}")
