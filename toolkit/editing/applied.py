"""A shot's edits, applied: what the stage "result" writes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.details import Reconstruction
from toolkit.editing.moved import moved_by
from toolkit.editing.opening import open_take
from toolkit.editing.stack import EditStack, Layer, State
from toolkit.errors import InputError
from toolkit.pose_edit import PoseEdit
from toolkit.progress import Progress, silent
from toolkit.shot import Shot
from toolkit.shot.journal import Edit

__all__ = ["AppliedEdits", "applied", "apply_edits"]


@dataclass(frozen=True, eq=False)
class AppliedEdits:
    """``state`` the take after the edits; ``record`` what each came to, as plain values for ``edits.json``."""

    state: State
    record: list[dict[str, Any]]

    @property
    def reconstruction(self) -> Reconstruction:
        """What builds the edited frames."""
        return self.state.reconstruction

    @property
    def weights(self) -> NDArray[np.float64]:
        """The edited weights, (T, K)."""
        return self.state.take.weights

    def moved(self) -> NDArray[np.float64]:
        """How far the edits move each frame at most, in the result's unit, (T,)."""
        return moved_by(self.state)

    def morphs(self, frames: NDArray[np.integer]) -> NDArray[np.float32]:
        """The edited bases as whole frames, (K, V, 3), with the details and head motion of ``frames`` (K,)."""
        take, opened = self.state.take, self.state.opened
        weights = np.array(take.weights)
        weights[frames] = np.eye(take.n_bases)
        alone = opened.reconstruction.edited(weights, take.edits, self.state.changes)
        shapes = np.empty((len(frames), take.n_vertices, 3), dtype=np.float32)
        for k, t in enumerate(int(frame) for frame in frames):
            alone.frames(t, t + 1, np.ascontiguousarray(opened.details[t : t + 1]), shapes[k : k + 1])
        return shapes


def apply_edits(shot: Shot, edits: Sequence[Edit], progress: Progress = silent) -> AppliedEdits:
    """Open the shot and solve the edits in their order; raises InputError for one that cannot be applied."""
    opened = open_take(shot, progress)
    stack = EditStack(opened, np.array(shot.array("inputs", "source_triangles")))
    return applied(shot, stack, stack.layers(edits, progress))


def applied(shot: Shot, stack: EditStack, layers: Sequence[Layer]) -> AppliedEdits:
    """The layers of a stack as what is to be written."""
    for layer in layers:
        if layer.problem is not None:
            raise InputError(
                f"the edit cannot be applied: {layer.problem.rstrip('.')}",
                where=f"edit {layer.edit.number}",
                remedy=f"change it, or switch it off with scripts/6_edit.py {shot.path} off {layer.edit.number}",
            )
    state = layers[-1].state if layers else stack.base
    return AppliedEdits(state, [_record(layer) for layer in layers])


def _record(layer: Layer) -> dict[str, Any]:
    edit = layer.edit
    found: dict[str, Any] = {"number": edit.number, "kind": edit.kind, "data": edit.data}
    if isinstance(layer.solved, PoseEdit):
        found["residuals"] = [{"left": one.left, "asked": one.asked} for one in layer.residuals]
        found["rounds"] = layer.solved.rounds
        found["window"] = list(layer.solved.window)
    elif layer.solved is not None:
        found["window"] = list(layer.solved.window)
        found["vertices"] = len(layer.solved.vertices)
    return found
