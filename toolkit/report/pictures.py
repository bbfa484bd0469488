"""The report's pictures, from arrays: how the registration went, what was split off, which frames are the bases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from toolkit.rendering.camera import Camera
from toolkit.rendering.colormap import ColorScale, add_legend
from toolkit.rendering.fields import coating_fields, motion_field
from toolkit.rendering.overlay import Lines, Markers
from toolkit.rendering.renderer import Renderer
from toolkit.rendering.takes import View
from toolkit.report.data import Figure
from toolkit.smoothing import SmoothingFilter

__all__ = ["bases_figures", "coating_figures", "motion_figures", "registration_figures"]

Array = NDArray[np.float64]
Ids = NDArray[np.integer]
_SIZE = (480, 600)


def registration_figures(
    target: View,
    distance: Array,
    unit: str,
    *,
    original: tuple[Array, Ids] | None = None,
    lines: Sequence[Lines] = (),
    landmarks: Ids | None = None,
    only: Ids | None = None,
    close_up: Ids | None = None,
    interior: NDArray[np.bool_] | None = None,
) -> list[Figure]:
    """Draw the target as given, the source's mesh in its shape, its distance from the target, and its wires.

    ``target`` views the registered face (source topology), ``distance`` (V,) from the target's surface, ``original``
    the target's own vertices and triangles, ``lines`` and ``landmarks`` on the source's topology, ``only`` the
    vertices that the camera frames, ``close_up`` those that the picture of the wires frames instead, ``interior`` (V,)
    what follows and is not fitted, shown grey.
    """
    camera = target.camera(_SIZE[0] / _SIZE[1], only=only)
    renderer = Renderer(target.triangles, target.material)
    figures = []
    if original is not None:
        given = Renderer(original[1], target.material).render(original[0], camera, _SIZE)
        figures.append(Figure(given, "The target as given, in its own topology."))
    marks: list[Lines | Markers] = [*lines, *([Markers(landmarks)] if landmarks is not None else [])]
    fitted = renderer.render(target.rest, camera, _SIZE, overlays=marks)
    figures.append(Figure(fitted, "The source's mesh in the target's shape, with landmarks and feature lines."))
    shown = np.where(interior, np.nan, distance) if interior is not None else distance
    scale = ColorScale.unsigned(shown, "distance from the target's surface", unit)
    painted = renderer.render(target.rest, camera, _SIZE, colors=scale.colors(shown))
    figures.append(Figure(add_legend(painted, scale), "Distance from the target's surface; grey is not fitted."))
    near = target.camera(_SIZE[0] / _SIZE[1], only=only if close_up is None else close_up, margin=0.03)
    wired = renderer.render(target.rest, near, _SIZE, wireframe=0.9)
    figures.append(Figure(wired, "Close-up: triangles should flow evenly, without folds at lids and lips."))
    return figures


def coating_figures(view: View, frame: int, smoothing: SmoothingFilter, unit: str) -> list[Figure]:
    """One frame, its smoothed shape and the coating between them, as in the paper's Figure 2."""
    camera = view.camera(_SIZE[0] / _SIZE[1])
    points = np.asarray(view.frame(frame), dtype=np.float64)
    smooth, length, along = coating_fields(points, view.triangles, smoothing)
    renderer = Renderer(view.triangles, view.material)
    # Open borders shrink when smoothed; their coating is large and says nothing, so it does not set the scale.
    scale = ColorScale.unsigned(length, "coating", unit, percentile=98.5)
    signed = ColorScale.signed(along, "coating along the normal", unit, percentile=98.5)

    def painted(values: Array, colors: ColorScale) -> NDArray[np.uint8]:
        return add_legend(renderer.render(points, camera, _SIZE, colors=colors.colors(values)), colors)

    return [
        Figure(renderer.render(points, camera, _SIZE), f"{view.label}: frame {frame} as captured."),
        Figure(renderer.render(smooth, camera, _SIZE), "Its large-scale shape: smoothed, no wrinkles left."),
        Figure(painted(length, scale), "Size of the coating: what was split off."),
        Figure(painted(along, signed), "Along the normal: ridges red, furrows blue."),
    ]


def motion_figures(views: Sequence[View], frame: int, heights: Sequence[float]) -> list[Figure]:
    """How far every vertex moved in one frame, head motion apart, in percent of the face's height, on one scale."""
    fields = [
        100 * motion_field(np.asarray(view.rest, dtype=np.float64), view.frame(frame)) / height
        for view, height in zip(views, heights, strict=True)
    ]
    scale = ColorScale.unsigned(np.stack(fields), "motion", "% of the face's height")
    figures = []
    for view, field in zip(views, fields, strict=True):
        camera = view.camera(_SIZE[0] / _SIZE[1])
        image = Renderer(view.triangles).render(view.frame(frame), camera, _SIZE, colors=scale.colors(field))
        figures.append(Figure(add_legend(image, scale), f"{view.label}: motion in frame {frame}."))
    return figures


def bases_figures(
    shapes: Sequence[tuple[View, Array]], frames: Ids, *, width: int = 240, limit: int = 21
) -> list[Figure]:
    """Thumbnails of the first ``limit`` bases: each picture has one face a view, source above target.

    ``shapes`` pairs a view with its bases (K, V, 3); ``frames`` (K,) are their frame numbers.
    """
    size = (width, round(width * 1.25))
    cameras: list[Camera] = [view.camera(size[0] / size[1]) for view, _ in shapes]
    renderers = [Renderer(view.triangles, view.material) for view, _ in shapes]
    figures = []
    for k, frame in enumerate(np.asarray(frames)[:limit]):
        rows = [
            renderer.render(bases[k], camera, size)
            for renderer, camera, (_, bases) in zip(renderers, cameras, shapes, strict=True)
        ]
        figures.append(Figure(np.concatenate(rows), f"Basis {k + 1}: frame {int(frame)}"))
    return figures
