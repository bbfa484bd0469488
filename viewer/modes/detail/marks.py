"""What the detail edit mode draws on the face: the region, lines, the paste's ring, the brush."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from toolkit.detail_edit import Curve as SurfaceCurve
from toolkit.detail_edit import SurfacePoint
from toolkit.rendering.camera import triple
from viewer.modes.base import Tint
from viewer.modes.shared.pointing import surface_places
from viewer.state.marks import BLUE, GREEN, ORANGE, WHITE, YELLOW, Color, Curve, Disc, Mark

if TYPE_CHECKING:
    from viewer.modes.detail_edit import DetailEditMode

__all__ = ["detail_marks", "detail_tint"]

_REGION = np.array([1.0, 0.62, 0.10], np.float32)
_GOAL = np.array([0.20, 0.85, 0.45], np.float32)
_SHARE, _SHARE_ON_MAP = 0.42, 0.2


def detail_tint(mode: DetailEditMode, pane: int) -> Tint | None:
    """The region in orange, where a copy or a bent wrinkle comes to lie in green."""
    draft = mode.draft
    if draft is None or not mode.show_region:
        return None
    count = len(mode.app.surface(pane).vertices)
    share = np.zeros(count, np.float32)
    colors = np.broadcast_to(_REGION, (count, 3)).copy()
    strength = _SHARE if mode.app.field(pane) is None else _SHARE_ON_MAP
    if draft.action in ("paste", "reshape") and mode.change is not None and not draft.empty:
        goal = mode.change.region
        share[goal.vertices] = strength * goal.weights
        colors[goal.vertices] = _GOAL
    if draft.region is not None and len(draft.region) and not (draft.action == "gain" and draft.everywhere):
        region = draft.region
        stronger = strength * region.weights >= share[region.vertices]
        ids = region.vertices[stronger]
        share[ids] = strength * region.weights[stronger]
        colors[ids] = _REGION
    return colors, share


def detail_marks(mode: DetailEditMode, pane: int) -> list[Mark]:
    """Marks of the open edit."""
    draft = mode.draft
    marks: list[Mark] = []
    if draft is not None:
        if mode.show_region:
            marks += _line(mode, pane, draft.line, draft.curve, YELLOW)
        if mode.show_region and draft.action == "reshape":
            marks += _line(mode, pane, draft.goal_line, draft.goal_curve, GREEN)
        if draft.action == "paste" and draft.start is not None:
            marks.append(Disc(_place(mode, pane, draft.start), BLUE, 5.0, "from"))
            ring = mode.ring(pane)
            if ring is not None:
                marks.append(Curve(ring.circle(draft.scale), GREEN, 1.8, closed=True))
                knob = ring.knob(draft.rotation, draft.scale)
                marks.append(Curve(np.stack([ring.middle, knob]), GREEN, 1.4))
                marks.append(Disc(triple(knob), WHITE, 6.0))
                marks.append(Disc(triple(ring.middle), GREEN, 5.0, "to"))
    if len(mode.stroke_places) > 1:
        marks.append(Curve(np.array(mode.stroke_places), GREEN if mode.tool == "goal" else YELLOW, 2.5))
    if mode.tool == "paint" and mode.under is not None and mode.under[0] == pane:
        marks.append(mode.brush.ring(mode.app, pane, mode.under[1], mode.picker))
    elif mode.tool in ("line", "goal") and mode.under is not None and mode.under[0] == pane:
        marks.append(Disc(mode.under[1].position, ORANGE, 3.0))
    return marks


def _line(
    mode: DetailEditMode, pane: int, points: tuple[SurfacePoint, ...], curve: SurfaceCurve | None, color: Color
) -> list[Mark]:
    marks: list[Mark] = []
    if curve is not None:
        marks.append(Curve(surface_places(mode.app, pane, curve.triangles, curve.weights), color, 2.5))
    marks += [Disc(_place(mode, pane, point), color, 4.0) for point in points]
    return marks


def _place(mode: DetailEditMode, pane: int, point: SurfacePoint) -> tuple[float, float, float]:
    return triple(surface_places(mode.app, pane, [point.triangle], [point.weights])[0])
