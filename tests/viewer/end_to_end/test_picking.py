"""On the sample itself, in the panes as the window lays them out: what is under the pointer is what is picked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from open3d import core
from open3d.t.geometry import RaycastingScene

from toolkit.shot import Shot
from viewer.layout import Rectangle, arrange
from viewer.state.app import App
from viewer.state.cameras import Viewpoint, pixel_ray
from viewer.worker import Worker

WINDOWS = [(900, 640), (1280, 720), (1920, 1080)]
ASKED = 200


@pytest.fixture
def app(finished: Path) -> Iterator[App]:
    worker = Worker()
    yield App(Shot(finished), worker)
    worker.stop()


class Embree:
    """Another one's rays, to judge ours by."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray) -> None:
        self._scene = RaycastingScene(nthreads=1)
        points = np.ascontiguousarray(vertices, np.float32)
        self._scene.add_triangles(core.Tensor(points), core.Tensor(triangles.astype(np.uint32)))

    def first(self, origin: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distances, and triangles (-1 none)."""
        rays = np.concatenate([np.broadcast_to(origin, directions.shape), directions], axis=1).astype(np.float32)
        answer = self._scene.cast_rays(core.Tensor(rays), nthreads=1)
        return answer["t_hit"].numpy(), answer["primitive_ids"].numpy().astype(np.int32)


@pytest.mark.parametrize("pane", [0, 1])
@pytest.mark.parametrize("window", WINDOWS)
def test_the_vertex_under_the_pointer_is_picked(app: App, pane: int, window: tuple[int, int]) -> None:
    app.pane_sizes = [place.size for place in arrange(Rectangle(0, 0, *window), 16).panes]
    app.go_to_frame(app.play.n_frames // 2)
    app.set_view(0, Viewpoint(17.0, 6.0, 2.4, (0.02, -0.05, 0.0)))
    surface, camera, size = app.surface(pane), app.framing_camera(pane), app.pane_sizes[pane]
    embree, origin = Embree(surface.vertices, surface.triangles), np.asarray(camera.position)
    toward = surface.vertices - origin
    reach = np.linalg.norm(toward, axis=1)
    screen = camera.project(surface.vertices, size)[:, :2]
    inside = ((screen > 1) & (screen < np.array(size) - 1)).all(axis=1)
    seen = (embree.first(origin, toward / reach[:, None])[0] >= reach * (1 - 1e-4)) & inside

    asked = 0
    for vertex in np.random.default_rng(pane).permutation(np.flatnonzero(seen)):
        x, y = np.floor(screen[vertex]) + 0.5  # where a pointer can be
        apart = np.where(seen, np.hypot(screen[:, 0] - x, screen[:, 1] - y), np.inf)
        front = int(embree.first(origin, pixel_ray(camera, x, y, size)[1][None])[1][0])
        # Another vertex may be nearer; and behind an outline the pointer is on what is in front.
        if apart[vertex] > apart.min() or front < 0 or not _joined(surface.triangles, front, vertex):
            continue
        hit = app.pick(pane, x, y)
        assert hit is not None
        assert apart[hit.vertex] == apart[vertex]
        asked += 1
        if asked == ASKED:
            return
    raise AssertionError(f"only {asked} vertices can be pointed at")


def _joined(triangles: np.ndarray, triangle: int, vertex: int) -> bool:
    """Whether a vertex is of a triangle, or of one that touches it."""
    near = np.isin(triangles, triangles[triangle]).any(axis=1)
    return bool((triangles[near] == vertex).any())
