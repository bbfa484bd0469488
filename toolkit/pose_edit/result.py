"""What an edit came to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.pose_edit.constraints import Constraint
from toolkit.pose_edit.take import EditableTake, LowRankMoves

__all__ = ["PoseEdit", "Residual"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Residual:
    """How far a constraint is from being met, in mesh units: ``left`` after the edit, ``asked`` before it.

    Of several vertices the farthest; for vertices fixed in all frames, the root mean square of the worst frame.
    """

    constraint: Constraint
    left: float
    asked: float


@dataclass(frozen=True, eq=False)
class PoseEdit:
    """An edit, solved.

    ``weights`` (T, K) the edited weights, ``moves`` the low-rank change of the bases (None: unchanged), ``window`` the
    frames whose weights were free, ``residuals`` one for each constraint, ``energies`` the whole energy (Eq. 12) at the
    start and after each round.
    """

    before: EditableTake
    weights: Array
    moves: LowRankMoves | None
    window: tuple[int, int]
    residuals: tuple[Residual, ...]
    energies: tuple[float, ...]

    @property
    def rounds(self) -> int:
        """Number of rounds that the solver took."""
        return len(self.energies) - 1

    @property
    def take(self) -> EditableTake:
        """The edited take: rebuild frames from it, or edit it further."""
        return self.before.edited(self.weights, self.moves)

    def bases(self) -> Array:
        """The edited bases ``b'``, earlier edits included, ``(K, V, 3)``."""
        take = self.take
        bases = np.array(take.moves, dtype=np.float64)
        for edit in take.edits:
            bases += edit.of_bases()
        return bases + take.rest

    def smooth_frame(self, frame: int) -> Array:
        """The edited smoothed surface of one frame, ``(V, 3)``."""
        return self.take.smooth_frame(frame)
