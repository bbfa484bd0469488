"""From an edit to what it does: the key frame's change, carried through the window."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit.change import DetailChange
from toolkit.detail_edit.edits import DetailEdit, GainEdit, KeyedEdit, ScaleEdit
from toolkit.detail_edit.region import Region, banded
from toolkit.detail_edit.take import DetailTake
from toolkit.detail_edit.window import activation, check_frame, check_window, find_window, gain_curve

__all__ = ["solve_detail_edit"]

Array = NDArray[np.float64]


def solve_detail_edit(edit: DetailEdit, take: DetailTake, other: DetailTake | None = None) -> DetailChange:
    """What an edit does to a take with its earlier changes.

    ``other`` is the shot that a `PasteEdit` takes its details from, if it names one. Raises ``InputError`` if the edit
    does not fit the take.
    """
    if isinstance(edit, GainEdit):
        return _gain(edit, take)
    take.surface.check_vertices(edit.region.vertices)
    check_frame(take, edit.frame)
    if isinstance(edit, ScaleEdit):
        return _scale(edit, take)
    raise NotImplementedError(type(edit).__name__)


def _gain(edit: GainEdit, take: DetailTake) -> DetailChange:
    if edit.region is None:
        region = Region.whole(np.arange(take.n_vertices))
    else:
        take.surface.check_vertices(edit.region.vertices)
        region = _with_band(edit.region, edit.band, take)
    curve = gain_curve(edit.gains, take.n_frames)
    if edit.details == "static":
        return _static_change(region, (curve[0] - 1) * region.weights, None)
    window = (0, take.n_frames - 1)
    return DetailChange(region.vertices, window, curve - 1, region.weights, None, None, None, region)


def _scale(edit: ScaleEdit, take: DetailTake) -> DetailChange:
    region = _with_band(edit.region, edit.band, take)
    scale = (edit.factor - 1) * region.weights
    if edit.details == "static":
        return _static_change(region, scale, None)
    window = _window(edit, take, edit.region, edit.frame)
    active = activation(window, edit.frame, take.n_frames)
    return DetailChange(region.vertices, window, active, scale, None, None, None, region)


def _with_band(region: Region, band: float, take: DetailTake) -> Region:
    return banded(take.surface, region, band * take.surface.edge(region.vertices))


def _window(edit: KeyedEdit, take: DetailTake, region: Region, frame: int) -> tuple[int, int]:
    if edit.window is None:
        return find_window(take, region, frame, edit.threshold)
    check_window(take, edit.window, edit.frame)
    return edit.window


def _static_change(region: Region, scale: Array | None, offset: Array | None) -> DetailChange:
    nothing = np.zeros(len(region))
    return DetailChange(region.vertices, (0, -1), np.zeros(0), nothing, None, scale, offset, region)
