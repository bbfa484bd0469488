"""What the pose edit mode draws on the face: handles, pulls, pairs, what is held, the brush."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from toolkit.pose_edit import DistanceConstraint, PointConstraint
from toolkit.rendering.camera import triple
from viewer.modes.base import Tint
from viewer.state.marks import BLUE, GREY, ORANGE, RED, WHITE, YELLOW, Curve, Disc, Mark, Text

if TYPE_CHECKING:
    from viewer.modes.pose_edit import PoseEdit

__all__ = ["pose_marks", "pose_tint"]

Array = NDArray[np.float64]

_MISSED = 0.006  # of the face's height: a handle that is this far from its point shows it
_HELD = np.array([0.20, 0.45, 0.95], np.float32)


def pose_marks(mode: PoseEdit, pane: int) -> list[Mark]:
    """Marks of the present frame."""
    marks: list[Mark] = []
    surface, frame = mode.app.surface(pane), mode.app.play.frame
    for index, handle in enumerate(mode.draft.handles if mode.draft is not None else ()):
        if handle.frame != frame:
            continue
        chosen = index == mode.selected
        if isinstance(handle, PointConstraint):
            now = surface.vertices[handle.vertex].astype(np.float64)
            marks += _point(mode, handle, index, chosen, now, surface.framing.height)
        else:
            ends = surface.vertices[list(handle.vertices)].astype(np.float64)
            marks += _pair(handle, index, chosen, ends)
    if mode.pending is not None:
        marks.append(Disc(triple(surface.vertices[mode.pending]), BLUE, 6.0, "first"))
    if mode.tool == "fix" and mode.under is not None and mode.under[0] == pane:
        marks.append(mode.brush.ring(mode.app, pane, mode.under[1]))
    return marks


def pose_tint(mode: PoseEdit, pane: int) -> Tint | None:
    """The vertices that are held."""
    draft = mode.draft
    if draft is None or (not draft.fixed and draft.beyond is None):
        return None
    if mode.tool != "fix" and mode.app.field(pane) is not None:
        return None  # the colour map is to be read
    share = np.zeros(len(mode.app.surface(pane).vertices), np.float32)
    share[list(draft.fixed)] = 0.55
    distance = mode.beyond.distance
    if draft.beyond is not None and draft.handles and distance is not None and len(distance) == len(share):
        share = np.maximum(share, np.where(distance > draft.beyond, np.float32(0.38), np.float32(0)))
    return _HELD, share


def _point(mode: PoseEdit, point: PointConstraint, index: int, chosen: bool, now: Array, height: float) -> list[Mark]:
    start, goal = mode.start(point.frame, point.vertex), mode.goal(point)
    color = ORANGE if chosen else YELLOW
    marks: list[Mark] = []
    if np.linalg.norm(goal - start) > 1e-3 * height:
        marks.append(Curve(np.stack([start, goal]), WHITE, 1.6))
        marks.append(Disc(triple(start), GREY, 2.6))
    if np.linalg.norm(goal - now) > _MISSED * height:
        marks.append(Curve(np.stack([now, goal]), RED, 2.2))
        marks.append(Disc(triple(now), RED, 3.0))
    marks.append(Disc(triple(goal), color, 6.5 if chosen else 5.0, str(index + 1)))
    return marks


def _pair(pair: DistanceConstraint, index: int, chosen: bool, ends: Array) -> list[Mark]:
    color = ORANGE if chosen else YELLOW
    asked = f"x {pair.factor:.2f}" if pair.factor is not None else f"{pair.length:.4g}"
    return [
        Curve(ends, color, 2.6 if chosen else 1.8),
        *(Disc(triple(end), color, 4.0) for end in ends),
        Text(triple(ends.mean(axis=0)), f"{index + 1}: {asked}", color),
    ]
