"""What edits do to single frames, as pictures: before, after, and how far the surface moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from toolkit.editing.session import EditSession
from toolkit.errors import InputError
from toolkit.rendering import ColorScale, Renderer, Row, add_legend, contact_sheet
from toolkit.rendering.overlay import Markers
from toolkit.rendering.regions import close_up_vertices
from toolkit.rendering.shots import ShotViews
from toolkit.stages.decompose import load_motion
from toolkit.stages.register import load_pose

__all__ = ["preview_sheet"]


def preview_sheet(
    session: EditSession,
    views: ShotViews,
    frames: Sequence[int],
    *,
    width: int = 480,
    aspect: float = 0.8,
    turn: float = 0.0,
    close_up: str | None = None,
    marks: Sequence[int] = (),
) -> NDArray[np.uint8]:
    """A row for each frame: before the edits, after them, and the distance between the two in colours.

    The head's motion is taken out, so that the camera sees the same part of the face in all frames. ``marks`` are
    vertices to mark. ``close_up`` is one of `toolkit.rendering.regions.CLOSE_UPS`.
    """
    target, motion = views.target, load_motion(session.shot).seen_from(load_pose(session.shot))
    only = None
    if close_up is not None:
        only = close_up_vertices(close_up, views.source.rest, views.landmarks)
        if only is None:
            raise InputError(f"too few landmarks are named after the {close_up} to find a close-up")
    camera, size = target.camera(aspect, turn=turn, only=only), (width, round(width / aspect))
    pairs = [(session.unedited_frame(t), session.frame(t)) for t in frames]
    moved = [np.sqrt(np.sum((after - before) ** 2, axis=1)) for before, after in pairs]
    scale = ColorScale.unsigned(np.stack(moved), "moved by", "target's unit", percentile=100, cmap="viridis")
    shaded, painted = Renderer(target.triangles, target.material), Renderer(target.triangles)
    overlays = [Markers(np.asarray(marks))] if len(marks) else []
    rows = []
    for t, (before, after), field in zip(frames, pairs, moved, strict=True):
        still = [(x - motion.translations[t]) @ motion.rotations[t] for x in (before, after)]
        images = [shaded.render(x, camera, size, overlays=overlays) for x in still]
        images.append(painted.render(still[1], camera, size, colors=scale.colors(field)))
        rows.append(Row(f"frame {t}", images))
    return add_legend(contact_sheet(rows, ["before", "after", "moved by"]), scale)
