"""What edits do to single frames, as pictures: before, after, and how far the surface moved."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.rendering import ColorScale, Renderer, Row, add_legend, contact_sheet
from toolkit.rendering.overlay import Markers
from toolkit.rendering.regions import close_up_vertices
from toolkit.rendering.shots import ShotViews

__all__ = ["preview_sheet"]

Frame = Callable[[int], NDArray[np.floating]]


def preview_sheet(
    views: ShotViews,
    frames: Sequence[int],
    before: Frame,
    after: Frame,
    *,
    width: int = 480,
    aspect: float = 0.8,
    turn: float = 0.0,
    close_up: str | None = None,
    marks: Sequence[int] = (),
) -> NDArray[np.uint8]:
    """A row for each frame: before the edits, after them, and the distance between the two in colours.

    ``before`` and ``after`` give frames (V, 3) of the result, such as `EditSession.unedited_frame` and `frame`.
    The head's motion is taken out, so that the camera sees the same part of the face in all frames. ``marks`` are
    vertices to mark. ``close_up`` is one of `toolkit.rendering.regions.CLOSE_UPS`.
    """
    target, motion = views.target, views.motions[1]
    only = None
    if close_up is not None:
        only = close_up_vertices(close_up, views.source.rest, views.landmarks)
        if only is None:
            raise InputError(f"too few landmarks are named after the {close_up} to find a close-up")
    camera, size = target.camera(aspect, turn=turn, only=only), (width, round(width / aspect))
    pairs = [(before(t), after(t)) for t in frames]
    moved = [np.sqrt(np.sum((new - old) ** 2, axis=1)) for old, new in pairs]
    scale = ColorScale.unsigned(np.stack(moved), "moved by", "target's unit", percentile=100, cmap="viridis")
    shaded, painted = Renderer(target.triangles, target.material), Renderer(target.triangles)
    overlays = [Markers(np.asarray(marks))] if len(marks) else []
    rows = []
    for t, pair, field in zip(frames, pairs, moved, strict=True):
        still = [(x - motion.translations[t]) @ motion.rotations[t] for x in pair]
        images = [shaded.render(x, camera, size, overlays=overlays) for x in still]
        images.append(painted.render(still[1], camera, size, colors=scale.colors(field)))
        rows.append(Row(f"frame {t}", images))
    return add_legend(contact_sheet(rows, ["before", "after", "moved by"]), scale)
