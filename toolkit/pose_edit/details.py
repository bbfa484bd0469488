"""What the details add to the smoothed surface at single vertices, so that edits are about what the user sees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from toolkit.decomposition import Decomposer
from toolkit.details import DetailsChange
from toolkit.mesh.geometry import local_frames
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
        self._changes, self._static = tuple(changes), target.rest.detail
        if changes:
            self._static = np.array(target.rest.detail)
            for change in changes:
                change.apply_static(self._static)
        self._patches: dict[int, tuple[Ids, Ids, int, int]] = {}

    def changed(self, changes: Sequence[DetailsChange]) -> VisibleDetails:
        """The same with other changes."""
        other = VisibleDetails(self._target, self._details, self._gain, changes)
        other._patches = self._patches
        return other

    def __call__(self, frame: int, vertices: Ids, shape_at: ShapeAt) -> Array:
        """Offsets (n, 3); ``shape_at`` gives the smoothed surface of that frame."""
        local = self._static[vertices] + self._moving(frame, vertices)
        turned = np.empty_like(local)
        for j, vertex in enumerate(vertices):
            turned[j] = self._frame_at(int(vertex), shape_at) @ local[j]
        return turned

    def _moving(self, frame: int, vertices: Ids) -> Array:
        acting = [change for change in self._changes if change.window[0] <= frame <= change.window[1]]
        if not acting:
            return np.asarray(self._details[frame, vertices], dtype=np.float64) * self._gain[vertices, None]
        scaled = (self._details[frame : frame + 1] * self._gain[:, None]).astype(np.float32)
        for change in acting:
            change.apply(scaled, frame)
        return np.asarray(scaled[0, vertices], dtype=np.float64)

    def _frame_at(self, vertex: int, shape_at: ShapeAt) -> Array:
        ids, triangles, at, neighbour = self._patch(vertex)
        neighbours = np.full(len(ids), neighbour)
        return np.asarray(local_frames(shape_at(ids), triangles, neighbours)[at])

    def _patch(self, vertex: int) -> tuple[Ids, Ids, int, int]:
        """The triangles round a vertex in a numbering of their own, with its place and its frame neighbour's there."""
        if vertex not in self._patches:
            everywhere = np.asarray(self._target.mesh.triangles)
            near = everywhere[(everywhere == vertex).any(axis=1)]
            neighbour = int(self._target.rest.neighbour[vertex])
            ids = np.unique(np.append(near.ravel(), [vertex, neighbour])).astype(np.int64)
            at, beside = np.searchsorted(ids, [vertex, neighbour])
            self._patches[vertex] = (ids, np.searchsorted(ids, near), int(at), int(beside))
        return self._patches[vertex]
