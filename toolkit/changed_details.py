"""What edits of details do to frames: a displacement of the vertices that they change, and of no others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from toolkit.decomposition import Decomposer
from toolkit.frame_kernels import block_frames, opposite_edges, rotate_details
from toolkit.mesh.patch import FramePatch

__all__ = ["ChangedDetails", "DetailsChange"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


class DetailsChange(Protocol):
    """A detail edit, solved: it acts in place on details that are scaled already, in the local frames."""

    @property
    def vertices(self) -> Ids:
        """Whose details it may change, (n,)."""

    @property
    def window(self) -> tuple[int, int]:
        """First and last frame whose moving details it may change."""

    def apply(self, values: NDArray[np.floating], start: int, vertices: Ids) -> None:
        """Change ``g s d_t`` of some frames from ``start`` on, (B, k, 3) at some ``vertices`` (k,)."""

    def apply_static(self, values: Array, vertices: Ids) -> None:
        """Change ``e_0'``, (k, 3) at some ``vertices`` (k,)."""


class ChangedDetails:
    """``G_t (D' - D)`` for the details D of a take and D' what edits make of them.

    It is added to the unedited displacement, so that vertices and frames which no edit touches stay bit for bit.

    Parameters
    ----------
    target : the decomposed target reference
    gain : (V,) factor of the motion details, size ratio included, in the blocks' numbering
    changes : the edits, in their order
    """

    def __init__(self, target: Decomposer, gain: NDArray[np.float32], changes: Sequence[DetailsChange]) -> None:
        self._changes = tuple(changes)
        self._vertices = np.unique(np.concatenate([change.vertices for change in changes]))
        self._rows = target.filter.position[self._vertices]
        self._gain = gain[self._rows, None]
        self._patch = FramePatch.around(target.block.triangles, target.block.neighbour, self._rows)
        self._own = target.rest.detail[self._vertices]
        own = np.array(self._own)
        for change in changes:
            change.apply_static(own, self._vertices)
        self._own_change = np.zeros((len(self._patch.ids), 3), dtype=np.float32)
        self._own_change[self._patch.at] = own - self._own
        self._stencil = (*opposite_edges(self._patch.triangles, len(self._patch.ids)), self._patch.neighbour)
        self._ones = np.ones(len(self._patch.ids), dtype=np.float32)

    def add(
        self,
        shift: NDArray[np.float32],
        points: NDArray[np.float32],
        details: NDArray[np.float32],
        start: int,
        *,
        as_seen: bool = False,
    ) -> None:
        """Add it to the displacements ``shift`` (V, 3, B) of the large-scale ``points`` (V, 3, B).

        ``details`` (B, V, 3) are the source's motion details of the frames from ``start`` on. With ``as_seen`` D is
        what ``shift`` shows instead, where that is another reconstruction of them.
        """
        stop = start + len(details)
        acting = [c for c in self._changes if c.window[0] < stop and c.window[1] >= start]
        if not acting and not self._own_change.any():
            return
        here = points[self._patch.ids]
        if as_seen:
            frames = block_frames(here, *self._stencil)[self._patch.at]
            plain = (np.einsum("vjib,vjb->bvi", frames, shift[self._rows]) - self._own).astype(np.float32)
        else:
            plain = details[:, self._vertices] * self._gain
        changed = plain.copy()
        for change in acting:
            change.apply(changed, start, self._vertices)
        changed -= plain
        block, added = np.zeros_like(here), np.empty_like(here)
        block[self._patch.at] = np.moveaxis(changed, 0, 2)
        rotate_details(here, *self._stencil, block, self._ones, self._own_change, added)
        shift[self._rows] += added[self._patch.at]
