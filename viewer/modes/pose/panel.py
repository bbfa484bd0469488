"""The panel of the pose edit mode: its rows, and what each does to the draft."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.pose_edit import DistanceConstraint, EditParameters, PointConstraint
from viewer.modes.pose.draft import Handle, PoseDraft
from viewer.state.rows import Button, Check, Choice, Entry, Heading, Items, Note, Number, Row, Slider

if TYPE_CHECKING:
    from viewer.modes.pose_edit import PoseEdit

__all__ = ["KEYS", "hint", "pose_rows", "used"]

KEYS = (
    ("g, d, b", "move points, set distances, hold by brush"),
    ("[, ], ctrl-wheel", "brush size"),
    ("delete", "delete the chosen point or distance"),
    ("enter, esc", "commit the edit, give it up"),
)
_SPREADS = (
    ("both", "expressions and time"),
    ("bases", "like expressions, anywhere"),
    ("weights", "time only, in the window"),
)
_FARTHEST = 0.6  # of the face's height, on the slider
_USUAL_BEYOND = 0.2
_LIST_ROWS = 6
_MET = 1e-4  # of the face's height: nobody sees what is left


def hint(mode: PoseEdit) -> str:
    """What a click will do now."""
    if mode.tool == "distance":
        return "click the second point of the pair" if mode.pending is not None else "click two points of the target"
    if mode.tool == "fix":
        return "drag to hold parts still, shift to let go; ctrl-wheel sizes the brush"
    return "drag a point of the target in the view plane; drag beside the face to turn"


def pose_rows(mode: PoseEdit) -> list[Row]:
    """All rows."""
    draft = mode.draft or PoseDraft()
    rows: list[Row] = [mode.tool_row(), *mode.commit_rows()]
    lines = tuple(_words(mode, index, handle) for index, handle in enumerate(draft.handles))
    rows.append(Items("handle", lines, mode.selected, _LIST_ROWS, "no points and no distances yet"))
    if 0 <= mode.selected < len(draft.handles):
        rows += _selected_rows(mode, draft.handles[mode.selected])
    rows += _held_rows(mode, draft)
    rows += _spread_rows(mode, draft)
    rows.append(Entry("note", "note", draft.note))
    return rows


def used(mode: PoseEdit, name: str, value: Any, final: bool) -> None:
    """A row was used."""
    if name == "delete":
        mode.delete()
    elif name == "handle":
        mode.select(int(value))
    else:
        _change_draft(mode, name, value, final)


def _change_draft(mode: PoseEdit, name: str, value: Any, final: bool) -> None:
    draft = mode.draft
    if draft is None:
        return
    chosen = draft.handles[mode.selected] if 0 <= mode.selected < len(draft.handles) else None
    if name in ("dx", "dy", "dz") and isinstance(chosen, PointConstraint):
        x, y, z = (
            float(value) if name[1] == axis else old for axis, old in zip("xyz", _offset(mode, chosen), strict=True)
        )
        mode.set(draft.with_handle(replace(chosen, place=None, offset=(x, y, z)), mode.selected), final)
    elif name == "factor" and isinstance(chosen, DistanceConstraint):
        asked = replace(chosen, factor=max(float(value), 0.0), length=None)
        mode.set(draft.with_handle(asked, mode.selected), final)
    elif name == "weight" and chosen is not None:
        mode.set(draft.with_handle(replace(chosen, weight=max(float(value), 1e-3)), mode.selected), final)
    elif name == "beyond":
        mode.set(replace(draft, beyond=_USUAL_BEYOND * _height(mode) if value else None))
        mode.app.touch("faces")
    elif name == "beyond_distance":
        mode.set(replace(draft, beyond=max(float(value), 1e-6 * _height(mode))), final)
        mode.app.touch("faces")
    elif name == "unfix":
        mode.set(replace(draft, fixed=()))
        mode.app.touch("faces")
    elif name == "spread":
        mode.set(draft.changed(mode=str(value)))
    elif name in ("lambda_b", "lambda_w", "lambda_e"):
        mode.set(draft.changed(**{name: max(float(value), 1e-9)}))
    elif name == "pull":
        mode.set(draft.changed(handle=float(np.clip(float(value) / 100, 0, 0.2))), final)
    elif name == "reach":
        mode.set(draft.changed(reach=float(np.clip(float(value) / 100, 0, 1))), final)
    elif name == "contacts":
        mode.set(draft.changed(contacts=EditParameters.contacts if value else 0.0))
    elif name == "smoothness":
        mode.set(draft.changed(smoothness=max(float(value), 0.0)))
    elif name == "note":
        mode.set(replace(draft, note=str(value)))
    else:
        return


def _selected_rows(mode: PoseEdit, chosen: Handle) -> list[Row]:
    rows: list[Row] = []
    if isinstance(chosen, PointConstraint):
        offset = _offset(mode, chosen)
        for axis, value in zip("xyz", offset, strict=True):
            rows.append(Number(f"d{axis}", f"d{axis}, in the target's unit", float(value)))
    else:
        factor = chosen.factor
        if factor is None:
            ends = [mode.start(chosen.frame, vertex) for vertex in chosen.vertices]
            factor = (chosen.length or 0.0) / max(float(np.linalg.norm(ends[0] - ends[1])), 1e-300)
        rows.append(Slider("factor", "times as far", factor, 0.0, 3.0))
    rows.append(Number("weight", "weight", chosen.weight, 1e-3, 1e3))
    rows.append(Button("delete", "Delete"))
    return rows


def _held_rows(mode: PoseEdit, draft: PoseDraft) -> list[Row]:
    rows: list[Row] = [Heading("Held still")]
    if mode.tool == "fix":
        rows.append(mode.brush_row())
    words = f"{len(draft.fixed):,} vertices painted" if draft.fixed else "nothing painted"
    if draft.fixed:
        words += _held_residual(mode, draft)
    rows.append(Note(words, "quiet"))
    if draft.fixed:
        rows.append(Button("unfix", "Let all painted go"))
    if mode.draft is not None:
        rows.append(Check("beyond", "all farther from the points than", draft.beyond is not None))
        if draft.beyond is not None:
            rows.append(Slider("beyond_distance", "distance", draft.beyond, 0.0, _FARTHEST * _height(mode)))
    return rows


def _spread_rows(mode: PoseEdit, draft: PoseDraft) -> list[Row]:
    if mode.draft is None:
        return []
    parameters = draft.parameters
    window = parameters.window
    words = f"weights change in frames {window[0]} to {window[1]}" if window else "weights change in all frames"
    outside = [frame for frame in draft.frames if window and not window[0] <= frame <= window[1]]
    rows: list[Row] = [
        Heading("How it spreads"),
        Choice("spread", "over", _SPREADS, parameters.mode),
        Note(words + " (drag the window on the time line)", "quiet"),
    ]
    if outside and parameters.mode == "weights":
        rows.append(Note(f"frame {outside[0]} lies outside the window", "bad"))
    rows.append(mode.settings_row())
    if mode.settings:
        rows += [
            Number("lambda_b", "keep expressions (lambda b)", parameters.lambda_b, 1e-6, 1e6),
            Number("lambda_w", "keep the motion (lambda w)", parameters.lambda_w, 1e-6, 1e6),
            Number("lambda_e", "meet the points (lambda e)", parameters.lambda_e, 1e-3, 1e9),
            Slider("pull", "pulled disc, % of the face", 100 * parameters.handle, 0.0, 10.0),
            Slider("reach", "reach, % of the face (0: all)", 100 * parameters.reach, 0.0, 50.0),
            Check("contacts", "what touches stays shut", parameters.contacts > 0),
            Number("smoothness", "smooth over frames", parameters.smoothness, 0.0, 200.0),
        ]
    return rows


def _words(mode: PoseEdit, index: int, handle: Handle) -> str:
    residual = mode.residual(index)
    left = "" if residual is None else f", {_left(mode, residual.left)}"
    if isinstance(handle, PointConstraint):
        size = float(np.linalg.norm(_offset(mode, handle)))
        moved = f"moved {_short(size)}" if size > 0 else "stays"
        return f"{index + 1}  frame {handle.frame}  vertex {handle.vertex}  {moved}{left}"
    asked = f"x {handle.factor:.2f}" if handle.factor is not None else f"to {_short(handle.length or 0.0)}"
    return f"{index + 1}  frame {handle.frame}  {handle.vertices[0]} to {handle.vertices[1]}  {asked}{left}"


def _held_residual(mode: PoseEdit, draft: PoseDraft) -> str:
    index = len(draft.handles)
    residual = mode.residual(index)
    if residual is None:
        return ""
    return "; they hold" if residual.left < _MET * _height(mode) else f"; they move by {_short(residual.left)}"


def _left(mode: PoseEdit, left: float) -> str:
    return "met" if left < _MET * _height(mode) else f"{_short(left)} left"


def _offset(mode: PoseEdit, point: PointConstraint) -> tuple[float, float, float]:
    if point.offset is not None:
        return point.offset
    x, y, z = (float(v) for v in mode.goal(point) - mode.start(point.frame, point.vertex))
    return x, y, z


def _height(mode: PoseEdit) -> float:
    return mode.app.data.target_framing.height


def _short(value: float) -> str:
    return f"{value:.3g}"
