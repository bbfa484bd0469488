"""What the details add to the smoothed surface at single vertices, so that edits are about what the user sees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from toolkit.changed_details import DetailsChange
from toolkit.decomposition import Decomposer
from toolkit.mesh.geometry import local_frames
from toolkit.mesh.patch import FramePatch
from toolkit.pose_edit.take import ShapeAt

__all__ = ["VisibleDetails"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


class VisibleDetails:
    """``G_t (e_0' + g s d_t)`` at a few vertices of a frame (`toolkit.details`): the detail offset of an edit.

    Parameters
    ----------
    target : the decomposed target reference
    details : (T, V, 3) the source's motion details, possibly memory-mapped
    gain : (V,) their factor, size ratio included
    changes : what edits of details do to them
    """

    def __init__(
        self,
        target: Decomposer,
        details: NDArray[np.floating],
        gain: Array,
        changes: Sequence[DetailsChange] = (),
    ) -> None:
        self._target, self._details, self._gain = target, details, gain
        self._changes = tuple(changes)
        self._patches: dict[int, FramePatch] = {}

    def changed(self, changes: Sequence[DetailsChange]) -> VisibleDetails:
        """The same with other changes."""
        other = VisibleDetails(self._target, self._details, self._gain, changes)
        other._patches = self._patches
        return other

    def __call__(self, frame: int, vertices: Ids, shape_at: ShapeAt) -> Array:
        """Offsets (n, 3); ``shape_at`` gives the smoothed surface of that frame."""
        local = self._target.rest.detail[vertices]
        moving = np.asarray(self._details[frame, vertices], dtype=np.float64)[None] * self._gain[vertices, None]
        for change in self._changes:
            change.apply_static(local, vertices)
            change.apply(moving, frame, vertices)
        local += moving[0]
        turned = np.empty_like(local)
        for j, vertex in enumerate(vertices):
            turned[j] = self._frame_at(int(vertex), shape_at) @ local[j]
        return turned

    def _frame_at(self, vertex: int, shape_at: ShapeAt) -> Array:
        patch = self._patches.get(vertex)
        if patch is None:
            triangles, neighbour = np.asarray(self._target.mesh.triangles), self._target.rest.neighbour
            patch = self._patches[vertex] = FramePatch.around(triangles, neighbour, np.array([vertex]))
        return np.asarray(local_frames(shape_at(patch.ids), patch.triangles, patch.neighbour)[patch.at[0]])
