"""How an edit spreads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolkit.errors import InputError

__all__ = ["EditParameters"]

_MODES = ("both", "bases", "weights")


@dataclass(frozen=True)
class EditParameters:
    """How an edit spreads over expressions and over time (Eq. 12).

    ``mode`` "both" solves for bases and weights, "bases" locks the weights (the edit reaches every frame of a similar
    expression), "weights" locks the bases (the edit stays in the window). The paper's lambda = 0 frees a term, it locks
    nothing. ``window`` (first, last) frame whose weights may change; None all frames.

    ``lambda_b``, ``lambda_w``, ``lambda_e`` weigh the change of the bases, of the weights' motion, and the
    constraints. Only their ratios count, and they mean the same at any size, unit and window: constraints are measured
    in units of the median edge, weights by how far the bases move the face and by the window's length. In the mode
    "weights" a tenth of ``lambda_e`` counts: nothing else gives way there, and expressions that hardly have the asked
    motion in them would be exaggerated beyond measure.

    ``handle`` is the radius of the disc that a pull takes hold of, as a share of the rest shape's diagonal; 0, the
    paper's, leaves a spike at every constrained vertex (`toolkit.pose_edit.bases_step`).

    ``reach`` is how far a pull on the bases carries over the surface, as a share of the same diagonal; beyond it fades.
    Without it (0, the paper's) only what the take never moves holds the face, and one brow takes the whole face along
    (`toolkit.pose_edit.bases_step`).

    ``contacts`` is how much lids and lips that touch count beside a constraint when the weights change
    (`toolkit.pose_edit.contacts`); 0, the paper's, lets them open. Those that a constraint takes hold of are free.

    ``smoothness`` is the time in frames below which weights prefer to bend slowly; 0 is the paper's velocity term
    alone. ``coupled`` lets the weights step know that the bases will follow; False is the paper's plain alternation,
    which stops earlier and farther from the optimum. ``tolerance`` ends the rounds when one gains less than this share.
    """

    mode: str = "both"
    window: tuple[int, int] | None = None
    lambda_b: float = 1.0
    lambda_w: float = 10.0
    lambda_e: float = 10000.0
    handle: float = 0.03
    reach: float = 0.1
    contacts: float = 1.0
    smoothness: float = 5.0
    coupled: bool = True
    tolerance: float = 0.05
    most_rounds: int = 30

    def __post_init__(self) -> None:
        if self.mode not in _MODES:
            raise InputError(f"an edit's mode cannot be {self.mode!r}", remedy=f"it is one of {', '.join(_MODES)}")
        if not (self.lambda_b > 0 and self.lambda_w > 0 and self.lambda_e > 0):
            raise InputError(
                f"lambda_b = {self.lambda_b}, lambda_w = {self.lambda_w}, lambda_e = {self.lambda_e}: all must be "
                "positive",
                remedy='to lock the bases or the weights, choose the mode "weights" or "bases"',
            )
        if not 0 <= self.handle < 1:
            raise InputError(
                f"a handle of {self.handle} times the face makes no sense", remedy="give a share like 0.015, or 0"
            )
        if not 0 <= self.reach < np.inf:
            raise InputError(
                f"a reach of {self.reach} makes no sense", remedy="give a share like 0.1, or 0 for no limit"
            )
        if not (self.contacts >= 0 and self.smoothness >= 0 and self.tolerance >= 0 and self.most_rounds >= 1):
            raise InputError(
                f"contacts = {self.contacts}, smoothness = {self.smoothness}, tolerance = {self.tolerance}, "
                f"most_rounds = {self.most_rounds} make no sense",
                remedy="give none that is negative, and at least one round",
            )

    def frames(self, n_frames: int) -> tuple[int, int]:
        """The window as first and last frame of a take of ``n_frames``."""
        first, last = self.window if self.window is not None else (0, n_frames - 1)
        if not 0 <= first <= last < n_frames:
            raise InputError(
                f"the window from frame {first} to {last} does not lie in the take",
                remedy=f"frames go from 0 to {n_frames - 1}",
            )
        return first, last
