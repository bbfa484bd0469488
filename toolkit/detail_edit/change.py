"""What an edit comes to: a factor and an addition to the details of some vertices over some frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit.region import Region

__all__ = ["DetailChange"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
_Places = Ids | slice


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

    def apply(self, values: NDArray[np.floating], start: int, vertices: Ids) -> None:
        """Edit the scaled details g s d_t (B, k, 3) of frames from ``start`` on at ``vertices`` (k,), in place."""
        rows, own = self._common(vertices)
        for t in self._frames(start, len(values)):
            values[t - start, rows] = self._edited(values[t - start, rows], t, own)

    def apply_static(self, values: NDArray[np.floating], vertices: Ids) -> None:
        """Edit the face's own details e_0' (k, 3) at ``vertices`` (k,), in place."""
        rows, own = self._common(vertices)
        if self.static_scale is not None:
            values[rows] *= 1 + self.static_scale[own, None]
        if self.static_offset is not None:
            values[rows] += self.static_offset[own]

    def touches(self, frame: int) -> bool:
        """Whether a frame changes."""
        if self.static_scale is not None or self.static_offset is not None:
            return True
        first, last = self.window
        return first <= frame <= last and (self.offset is not None or bool(self.activation[frame - first] != 0))

    def _frames(self, start: int, count: int) -> range:
        first, last = self.window
        return range(max(start, first), min(start + count, last + 1))

    def _edited(self, values: NDArray[np.floating], frame: int, own: _Places) -> NDArray[np.floating]:
        k = frame - self.window[0]
        active = self.activation[k]
        if active != 0:
            values = values * (1 + active * self.scale[own]).astype(np.float32)[:, None]
        if self.offset is not None:
            values = values + self.offset[k, own]
        return values

    def _common(self, vertices: Ids) -> tuple[_Places, _Places]:
        """Places in ``vertices`` of those that the edit knows, and their places here."""
        if np.array_equal(vertices, self.vertices):  # as for a single edit
            return slice(None), slice(None)
        found = np.minimum(np.searchsorted(self.vertices, vertices), len(self.vertices) - 1)
        rows = np.flatnonzero(self.vertices[found] == vertices)
        return rows, found[rows]
