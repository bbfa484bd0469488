"""Pictures of whole takes: which frames to show, from where, and many frames at once."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import worker_count
from toolkit.errors import InputError
from toolkit.progress import Progress, silent
from toolkit.rendering.camera import Camera
from toolkit.rendering.extras import Extras
from toolkit.rendering.renderer import Renderer
from toolkit.rendering.shading import CLAY, Material
from toolkit.rendering.sheet import Row, contact_sheet, side_by_side

__all__ = ["View", "choose_frames", "performance_sheet", "performance_video", "pictures_of"]

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

_ASPECT = 0.8


@dataclass(frozen=True)
class View:
    """One performance as it is looked at.

    ``label`` for its row, ``triangles`` (F, 3), ``rest`` (V, 3) which the camera is fixed on, ``n_frames``,
    ``frame`` reads the positions (V, 3) of one frame and may be called from several threads, ``forward`` from the face
    to its viewer and ``up`` in its frame of reference, ``focus`` (N,) the vertices that the camera frames, all by
    default; ``extras`` are drawn beside the skin.
    """

    label: str
    triangles: NDArray[np.integer]
    rest: Array
    n_frames: int
    frame: Callable[[int], NDArray[np.floating]]
    material: Material = CLAY
    forward: tuple[float, float, float] = (0.0, 0.0, 1.0)
    up: tuple[float, float, float] = (0.0, 1.0, 0.0)
    focus: NDArray[np.integer] | None = None
    extras: Extras | None = None

    def renderer(self) -> Renderer:
        """Draws what `drawn` returns."""
        if self.extras is None:
            return Renderer(self.triangles, self.material)
        triangles = np.concatenate([self.triangles, self.extras.triangles + len(self.rest)])
        shares = [(self.material, len(self.rest)), (self.extras.material, len(self.extras.rest))]
        albedo = np.concatenate([np.tile(material.albedo, (count, 1)) for material, count in shares])
        return Renderer(triangles, self.material, albedo=albedo)

    def drawn(self, index: int) -> NDArray[np.floating]:
        """Positions of the skin and of what is drawn beside it in one frame."""
        skin = self.frame(index)
        return skin if self.extras is None else np.concatenate([skin, self.extras.frame(index)])

    def camera(
        self, aspect: float, *, turn: float = 0.0, only: NDArray[np.integer] | None = None, margin: float = 0.08
    ) -> Camera:
        """Camera on the rest face, or on the vertices ``only`` of it; ``turn`` degrees to the side.

        The rest face has its mouth shut, so a little more room is left than it needs.
        """
        focus = self.focus if only is None else only
        points = self.rest if focus is None else self.rest[focus]
        front = Camera.facing(points, self.forward, self.up, aspect=aspect)
        toward = np.subtract(front.orbited(azimuth=turn).position, front.target)
        return Camera.facing(points, toward, self.up, aspect=aspect, margin=margin)


def choose_frames(features: NDArray[np.floating], count: int, first: int = 0) -> list[int]:
    """Pick ``count`` frames that differ most, in their order in time.

    ``features`` (T, D), e.g. the bases' weights or some displacements. Farthest-point sampling: beginning with
    ``first``, each pick is the frame farthest from all picked ones.
    """
    table = np.asarray(features, dtype=np.float64).reshape(len(features), -1)
    picks = [first]
    distance = np.linalg.norm(table - table[first], axis=1)
    while len(picks) < min(count, len(table)):
        distance[picks] = -1.0  # never twice, not even in a take that stands still
        picks.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(table - table[picks[-1]], axis=1))
    return sorted(picks)


def pictures_of(
    view: View,
    frames: Sequence[int],
    camera: Camera,
    size: tuple[int, int],
    *,
    workers: int | None = None,
) -> Iterator[Image]:
    """Render ``frames`` one after another on threads, in order; only a few pictures are held at a time."""
    renderer = view.renderer()

    def draw(index: int) -> Image:
        return renderer.render(view.drawn(index), camera, size)

    count = workers or worker_count()
    with ThreadPoolExecutor(count) as pool:
        waiting: deque[Future[Image]] = deque()
        try:
            for index in frames:
                waiting.append(pool.submit(draw, index))
                if len(waiting) > 2 * count:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


def performance_sheet(
    views: Sequence[View],
    frames: Sequence[int],
    *,
    width: int = 300,
    aspect: float = _ASPECT,
    turn: float = 0.0,
    title: str = "",
    only: NDArray[np.integer] | None = None,
    progress: Progress = silent,
) -> Image:
    """Contact sheet with one row a view, the same frames in each; ``only`` close-up vertices, shared by all views."""
    _check_frames(views, frames)
    size = (width, round(width / aspect))
    rows = []
    for k, view in enumerate(views):
        camera = view.camera(aspect, turn=turn, only=only)
        rows.append(Row(view.label, list(pictures_of(view, frames, camera, size))))
        progress("rendering the contact sheet", k + 1, len(views))
    return contact_sheet(rows, [f"frame {index}" for index in frames], title)


def performance_video(
    views: Sequence[View],
    frames: Sequence[int],
    *,
    height: int = 600,
    turn: float = 0.0,
    progress: Progress = silent,
) -> Iterator[Image]:
    """Yield the frames of a side-by-side video of all views, labelled, the frame's number at the right."""
    _check_frames(views, frames)
    size = (2 * round(height * _ASPECT / 2), 2 * round(height / 2))
    streams = [pictures_of(view, frames, view.camera(_ASPECT, turn=turn), size) for view in views]
    labels = [view.label for view in views]
    for done, (index, *images) in enumerate(zip(frames, *streams, strict=True), start=1):
        yield side_by_side(images, labels, str(index))
        progress("rendering the video", done, len(frames))


def _check_frames(views: Sequence[View], frames: Sequence[int]) -> None:
    if not views or len(frames) == 0:
        raise InputError("there is nothing to render: no view or no frame")
    for view in views:
        wrong = [index for index in frames if not 0 <= index < view.n_frames]
        if wrong:
            raise InputError(
                f"frame {wrong[0]} is not in the take, which has {view.n_frames} frames, 0 to {view.n_frames - 1}",
                where=view.label,
                remedy="choose other frames",
            )
