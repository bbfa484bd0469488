"""The detail offsets of the paper's own reconstruction, for which a frame has to be solved as a whole."""

from __future__ import annotations

from collections import OrderedDict

import numpy as np
from numpy.typing import NDArray

from toolkit.details import Reconstruction
from toolkit.pose_edit.take import ShapeAt

__all__ = ["CoatingOffsets"]

_MOST_FRAMES = 16


class CoatingOffsets:
    """What details add at some vertices of a frame, from the frame's own screened solve; the last frames are kept."""

    def __init__(self, reconstruction: Reconstruction, details: NDArray[np.float32]) -> None:
        self._reconstruction, self._details = reconstruction, details
        self._known: OrderedDict[int, NDArray[np.float32]] = OrderedDict()

    def __call__(self, frame: int, vertices: NDArray[np.int64], shape_at: ShapeAt) -> NDArray[np.float64]:
        """Offsets (n, 3); the smoothed surface is the reconstruction's own."""
        if frame not in self._known:
            block = np.ascontiguousarray(self._details[frame : frame + 1])
            self._known[frame] = self._reconstruction.detail_offsets(frame, block)
            while len(self._known) > _MOST_FRAMES:
                self._known.popitem(last=False)
        return np.asarray(self._known[frame][vertices], dtype=np.float64)
