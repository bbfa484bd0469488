"""What an edit comes to: a factor and an addition to the details of some vertices over some frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit.region import Region

__all__ = ["DetailChange"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class DetailChange:
    """An edit, solved: ``D'_t(v) = (1 + activation_t scale_v) D_t(v) + offset_t(v)``, and the same for the static ones.

    All of it belongs to the vertices, so that a wrinkle stays on its skin while the face moves.

    ``vertices`` (n,) ascending; ``window`` first and last frame, m in all; ``activation`` (m,) and ``scale`` (n,);
    ``offset`` (m, n, 3) or None; ``static_scale`` (n,) and ``static_offset`` (n, 3), or None where the edit leaves the
    static details alone. ``region`` what to highlight: where the edit takes hold, and how much.
    """

    vertices: Ids
    window: tuple[int, int]
    activation: Array
    scale: Array
    offset: NDArray[np.float32] | None
    static_scale: Array | None
    static_offset: Array | None
    region: Region

    def apply(self, details: NDArray[np.float32], start: int) -> None:
        """Edit the scaled details g s d_t (B, V, 3) of frames from ``start`` on, in place; nothing else is touched."""
        everything = len(self.vertices) == details.shape[1]
        rows: slice | Ids = slice(None) if everything else self.vertices
        for t in self._frames(start, len(details)):
            details[t - start, rows] = self._edited(details[t - start, rows], t, slice(None))

    def apply_at(self, values: NDArray[np.float32], start: int, vertices: Ids) -> None:
        """As `apply`, on the details (B, n, 3) of some ``vertices`` (n,) alone."""
        rows, own = self._common(vertices)
        if len(rows) == 0:
            return
        for t in self._frames(start, len(values)):
            values[t - start, rows] = self._edited(values[t - start, rows], t, own)

    def apply_static(self, static: NDArray[np.floating]) -> None:
        """Edit the face's own details e_0' (V, 3), in place."""
        self.apply_static_at(static, np.arange(len(static)))

    def apply_static_at(self, values: NDArray[np.floating], vertices: Ids) -> None:
        """As `apply_static`, on some ``vertices`` (n,) alone: ``values`` (n, 3)."""
        if self.static_scale is None and self.static_offset is None:
            return
        rows, own = self._common(vertices)
        if self.static_scale is not None:
            values[rows] *= 1 + self.static_scale[own, None]
        if self.static_offset is not None:
            values[rows] += self.static_offset[own]

    def touches(self, frame: int) -> bool:
        """Whether a frame's motion details change."""
        first, last = self.window
        return first <= frame <= last and (self.offset is not None or bool(self.activation[frame - first] != 0))

    def _frames(self, start: int, count: int) -> range:
        first, last = self.window
        return range(max(start, first), min(start + count, last + 1))

    def _edited(self, values: NDArray[np.float32], frame: int, own: slice | Ids) -> NDArray[np.float32]:
        k = frame - self.window[0]
        active = self.activation[k]
        if active != 0:
            values = values * (1 + active * self.scale[own]).astype(np.float32)[:, None]
        if self.offset is not None:
            values = values + self.offset[k, own]
        return values

    def _common(self, vertices: Ids) -> tuple[Ids, Ids]:
        """Places in ``vertices`` of those that the edit knows, and their places here."""
        if len(self.vertices) == 0:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        found = np.minimum(np.searchsorted(self.vertices, vertices), len(self.vertices) - 1)
        rows = np.flatnonzero(self.vertices[found] == vertices)
        return rows, found[rows]
