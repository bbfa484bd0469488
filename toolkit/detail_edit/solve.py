"""From an edit to what it does: the key frame's change, carried through the window.

**How an edit goes on in time.** The paper asks the edited details for the same temporal and spatial gradients as the
unedited ones (Eq. 20). The spatial part works against the edit itself, whose gradients are those of a wrinkle: at the
paper's weights a wrinkle ten edges wide is changed by 83 % of what was asked at the key frame and by 34 % in the frames
beside it (benchmarks/detail_edit.py); it flickers. "follow", the default, compares with the gradients of the *edited*
source motion, which the operation gives for every frame of the window (scaled by the factor, pasted from the wrinkle as
it is in that frame), faded out towards the ends. That reference meets the key frame and the ends exactly, so it is the
minimum itself:

    D'_t = D_t + a_t w (op(D)_t - D_t)          a_t `activation`, w the region with its band

An enhanced wrinkle grows and goes with the performance, a removed one never turns into a ridge. "gradients" is the
paper's own least squares (`toolkit.detail_edit.propagation`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit.carry import Carrier
from toolkit.detail_edit.change import DetailChange
from toolkit.detail_edit.edits import DetailEdit, GainEdit, KeyedEdit, PasteEdit, ReshapeEdit, ScaleEdit
from toolkit.detail_edit.placing import paste_carrier, reshape_carrier
from toolkit.detail_edit.propagation import GradientWeights, propagated, region_laplacian
from toolkit.detail_edit.region import Region, banded
from toolkit.detail_edit.take import DetailTake
from toolkit.detail_edit.window import activation, check_frame, check_window, find_window, gain_curve
from toolkit.errors import InputError

__all__ = ["solve_detail_edit"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
T = TypeVar("T")


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
        change = _scale(edit, take)
    elif isinstance(edit, PasteEdit):
        change = _paste(edit, take, other)
    else:
        change = _reshape(edit, take)
    if edit.propagation == "gradients" and edit.details == "dynamic":
        return _by_gradients(edit, change, take)
    return change


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
    window = _window(edit, take, take, edit.frame)
    active = activation(window, edit.frame, take.n_frames)
    return DetailChange(region.vertices, window, active, scale, None, None, None, region)


def _paste(edit: PasteEdit, take: DetailTake, other: DetailTake | None) -> DetailChange:
    source = _source_of(edit, take, other)
    region = _with_band(edit.region, edit.band, source)
    carrier = paste_carrier(edit, region, take, source)
    goal = carrier.goal
    if len(goal) == 0:
        raise InputError("the paste meets no vertex of the face", remedy="choose another goal or a larger scale")
    kept = np.zeros(len(goal)) if edit.add else -goal.weights
    if edit.details == "static":
        laid = carrier.carry(source.static_at(carrier.source)[None])[0]
        return _static_change(goal, kept, goal.weights[:, None] * laid)
    frame = edit.frame if edit.source_frame is None else edit.source_frame
    check_frame(source, frame)
    window = _window(edit, take, source, frame)
    active = activation(window, edit.frame, take.n_frames)
    shift = frame - edit.frame
    frames = np.full(len(active), frame) if edit.hold else np.arange(window[0], window[1] + 1) + shift
    offset = _laid(carrier, source, np.clip(frames, 0, source.n_frames - 1), active[:, None] * goal.weights)
    return DetailChange(goal.vertices, window, active, kept, offset, None, None, goal)


def _reshape(edit: ReshapeEdit, take: DetailTake) -> DetailChange:
    region = _with_band(edit.region, edit.band, take)
    carrier = reshape_carrier(edit, region, take)
    both = region.joined(carrier.goal)
    places = np.searchsorted(both.vertices, carrier.goal.vertices)
    old, new = region.field(take.n_vertices)[both.vertices], np.zeros(len(both))
    new[places] = carrier.goal.weights
    kept = (1 - old) * (1 - new) - 1  # removed where it was, and out of the way where it comes to lie
    if edit.details == "static":
        laid = carrier.carry(take.static_at(carrier.source)[None])[0]
        added = np.zeros((len(both), 3))
        added[places] = carrier.goal.weights[:, None] * laid
        return _static_change(both, kept, added)
    window = _window(edit, take, take, edit.frame)
    active = activation(window, edit.frame, take.n_frames)
    frames = np.arange(window[0], window[1] + 1)
    offset = np.zeros((len(active), len(both), 3), dtype=np.float32)
    offset[:, places] = _laid(carrier, take, frames, active[:, None] * carrier.goal.weights)
    return DetailChange(both.vertices, window, active, kept, offset, None, None, both)


def _by_gradients(edit: KeyedEdit, change: DetailChange, take: DetailTake) -> DetailChange:
    """The same change of the key frame, carried through the window as the paper does."""
    before = take.dynamic(edit.frame, edit.frame, change.vertices)
    after = before.copy()
    change.apply(after, edit.frame, change.vertices)
    surface = take.surface
    laplacian = region_laplacian(surface.triangles[surface.triangles_at(change.vertices)], change.vertices)
    asked = (after - before)[0].astype(np.float64)
    offset = propagated(laplacian, asked, change.window, edit.frame, GradientWeights())
    return replace(change, activation=np.zeros(len(offset)), offset=offset.astype(np.float32))


def _laid(carrier: Carrier, source: DetailTake, frames: Ids, weights: Array) -> NDArray[np.float32]:
    """Carried details of the source's ``frames`` (m,), times ``weights`` (m, g): ``(m, g, 3)``."""
    wanted, at = np.unique(frames, return_inverse=True)
    details = source.dynamic(int(wanted[0]), int(wanted[-1]), carrier.source)[wanted - wanted[0]]
    return carrier.carry(details)[at] * weights[:, :, None].astype(np.float32)


def _source_of(edit: PasteEdit, take: DetailTake, other: DetailTake | None) -> DetailTake:
    if edit.source_shot is None:
        return take
    if other is None:
        raise InputError(f"the details come from the shot {edit.source_shot!r}, which was not opened")
    if not np.array_equal(other.surface.triangles, take.surface.triangles):
        raise InputError(
            f"the shot {edit.source_shot!r} has another topology ({other.n_vertices} vertices, {take.n_vertices} here)",
            remedy="paste from a shot of the same performer's mesh",
        )
    return other


def _with_band(region: Region, band: float, take: DetailTake) -> Region:
    def make() -> Region:
        return banded(take.surface, region, band * take.surface.edge(region.vertices))

    return _kept(take, region, ("band", band), make)


def _window(edit: KeyedEdit, take: DetailTake, source: DetailTake, frame: int) -> tuple[int, int]:
    """The edit's window, or the one in which the ``source``'s wrinkle is there round its ``frame``."""
    if edit.window is not None:
        check_window(take, edit.window, edit.frame)
        return edit.window

    def find() -> tuple[int, int]:
        return find_window(source, edit.region, frame, edit.threshold)

    first, last = _kept(source, edit.region, ("window", frame, edit.threshold), find)
    shift = edit.frame - frame
    return max(first + shift, 0), min(last + shift, take.n_frames - 1)


def _kept(take: DetailTake, region: Region, what: tuple[object, ...], make: Callable[[], T]) -> T:
    """What stays the same while a factor is dragged or a paste turned."""
    found: T = take.shared.get((*what, region.vertices.tobytes(), region.weights.tobytes()), make)
    return found


def _static_change(region: Region, scale: Array, offset: Array | None) -> DetailChange:
    nothing = np.zeros(len(region))
    return DetailChange(region.vertices, (0, -1), np.zeros(0), nothing, None, scale, offset, region)
