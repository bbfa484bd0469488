"""The report's section on edits: what was asked and reached, which frames moved, and the edited curves."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.editing.preview import preview_sheet
from toolkit.editing.words import describe
from toolkit.rendering.shots import ShotViews
from toolkit.report.charts import line_chart
from toolkit.report.data import Chart, Figure, Section
from toolkit.shot import Shot
from toolkit.shot.journal import Edit
from toolkit.stages.result import open_reconstruction

__all__ = ["edits_section"]

_MOST_CURVES = 4


def edits_section(shot: Shot, views: ShotViews) -> Section | None:
    """From what the stage "result" left; None where it has no edits."""
    path = shot.stage_folder("result") / "edits.json"
    if not path.exists():
        return None
    edits = json.loads(path.read_text(encoding="utf-8"))["edits"]
    moved = np.array(shot.array("result", "moved"))
    weights, edited = np.array(shot.array("bases", "weights")), np.array(shot.array("result", "weights"))
    charts = [
        Chart(line_chart({"moved": moved}, y_label="target's unit"), "How far the edits move each frame at most.")
    ]
    changed = np.abs(edited - weights).max(axis=0)
    for k in np.argsort(-changed)[:_MOST_CURVES]:
        if changed[k] > 1e-3:
            curves = {"source": weights[:, k], "edited": edited[:, k]}
            charts.append(Chart(line_chart(curves, y_label="weight"), f"Basis {k + 1}: its weight, before and after."))
    return Section(
        "Edits",
        "What was changed by hand, in the order in which it acts. What a constraint leaves over tells contradictions: "
        "two that cannot both be met leave something each.",
        _figures(shot, views, moved),
        charts,
        {"edits": len(edits), "edits_move_at_most": float(moved.max())},
        [_line(edit) for edit in edits],
    )


def _line(record: dict[str, Any]) -> str:
    edit = Edit(record["number"], record["kind"], record["data"])
    line = f"Edit {edit.number}: {describe(edit)}."
    for constraint, residual in zip(edit.data.get("constraints", []), record.get("residuals", []), strict=False):
        if constraint["kind"] in ("point", "distance"):
            line += f" {constraint['kind'].capitalize()}: {residual['asked']:.3g} asked, {residual['left']:.2g} left."
    return line


def _figures(shot: Shot, views: ShotViews, moved: NDArray[np.float64]) -> list[Figure]:
    """The frame that was moved farthest, before and after."""
    if not moved.any():
        return []
    reconstruction, details = open_reconstruction(shot), shot.array("decompose", "details")

    def before(t: int) -> NDArray[np.float32]:
        out = np.empty((1, *details.shape[1:]), dtype=np.float32)
        reconstruction.frames(t, t + 1, np.ascontiguousarray(details[t : t + 1]), out)
        return out[0]

    sheet = preview_sheet(views, [int(moved.argmax())], before, views.target.frame, width=360)
    return [Figure(sheet, "The frame that was moved farthest.", wide=True)]
