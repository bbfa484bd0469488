"""Colour maps of shots as rows of a contact sheet, all faces on one scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.rendering.colormap import ColorScale, add_legend
from toolkit.rendering.fields import coating_fields, motion_field
from toolkit.rendering.overlay import Lines
from toolkit.rendering.regions import close_up_vertices
from toolkit.rendering.renderer import Renderer
from toolkit.rendering.sheet import Row, contact_sheet
from toolkit.rendering.shots import ShotViews
from toolkit.rendering.takes import View
from toolkit.report.data import Figure
from toolkit.report.pictures import registration_figures
from toolkit.shot import Shot
from toolkit.stages.decompose import source_decomposer
from toolkit.stages.inputs import load_lines, load_mesh

__all__ = ["map_sheet", "shot_registration_figures"]

_SIZE = (360, 450)
_UNIT = "% of the face's height"


def map_sheet(
    name: str, shots: Sequence[Shot], opened: Sequence[ShotViews], frames: Sequence[int]
) -> NDArray[np.uint8]:
    """Sheet of the map ``"motion"``, ``"coating"`` (source first, then every result) or ``"registration"``.

    Values are in percent of each face's height, so that faces of different sizes can be compared.
    """
    views = [opened[0].source, *(each.target for each in opened)]
    heights = [opened[0].face_heights[0], *(each.face_heights[1] for each in opened)]
    if name == "registration":
        return contact_sheet([_registration_row(shot, each) for shot, each in zip(shots, opened, strict=True)])
    if name == "motion":
        fields = [[motion_field(view.rest, view.frame(t)) for t in frames] for view in views]
        cmap = "viridis"
    elif name == "coating":
        smoothing = source_decomposer(shots[0]).filter
        fields = [[coating_fields(view.frame(t), view.triangles, smoothing)[1] for t in frames] for view in views]
        cmap = "magma"
    else:
        raise InputError(f"no map is called {name!r}", remedy="use coating, registration or motion")
    shares = [100 * np.stack(row) / height for row, height in zip(fields, heights, strict=True)]
    scale = ColorScale.unsigned(np.stack(shares), name, _UNIT, cmap=cmap)
    rows = [_painted_row(view, frames, share, scale) for view, share in zip(views, shares, strict=True)]
    return add_legend(contact_sheet(rows, [f"frame {index}" for index in frames]), scale)


def shot_registration_figures(shot: Shot, views: ShotViews) -> list[Figure]:
    """The registration's pictures of one shot."""
    target, interior = load_mesh(shot, "target"), np.array(shot.array("register", "interior"))
    return registration_figures(
        views.target,
        100 * np.array(shot.array("register", "distance")) / views.face_heights[1],
        _UNIT,
        original=(target.vertices, target.triangles),
        lines=[Lines(line.vertices, line.closed) for line in load_lines(shot)],
        landmarks=np.array(list(views.landmarks.values()), dtype=np.int64),
        close_up=close_up_vertices("features", views.source.rest, views.landmarks),
        interior=interior if interior.any() else None,
    )


def _painted_row(view: View, frames: Sequence[int], fields: NDArray[np.float64], scale: ColorScale) -> Row:
    renderer, camera = Renderer(view.triangles), view.camera(_SIZE[0] / _SIZE[1])
    images = [
        renderer.render(view.frame(t), camera, _SIZE, colors=scale.colors(field))
        for t, field in zip(frames, fields, strict=True)
    ]
    return Row(view.label, images)


def _registration_row(shot: Shot, views: ShotViews) -> Row:
    images = [figure.image for figure in shot_registration_figures(shot, views)]
    tallest = max(image.shape[0] for image in images)
    room = [((0, tallest - image.shape[0]), (0, 0), (0, 0)) for image in images]
    padded = [np.pad(image, pad, constant_values=22) for image, pad in zip(images, room, strict=True)]
    return Row(views.target.label, padded)
