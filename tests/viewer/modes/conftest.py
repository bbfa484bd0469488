from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.shot import Shot
from toolkit.shot.journal import Journal
from toolkit.stages import run_stages
from viewer.picking import Picker
from viewer.state.app import App
from viewer.state.cameras import pixel_ray
from viewer.state.events import Pointer
from viewer.worker import Worker

SCALE, PLACE = 7.3, np.array([20.0, -5.0, 40.0])
KEY, MIDDLE = 20, 11 * 31 + 15


@pytest.fixture(scope="session")
def _finished(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return {}


@pytest.fixture
def shot(bump: TriangleMesh, take: np.ndarray, tmp_path: Path, tmp_path_factory, _finished: dict[str, Path]) -> Shot:
    """A finished shot of its own, 24 x 31 vertices (31 along y) and 40 frames, the target 7.3 times as large."""
    if not _finished:
        folder = tmp_path_factory.mktemp("finished") / "shot"
        folder.mkdir()
        write_mesh(folder / "source.ply", bump)
        target = bump.with_vertices(SCALE * bump.vertices * [1.15, 0.95, 1.05] + PLACE)
        write_mesh(folder / "target.ply", target)
        np.save(folder / "take.npy", take.astype(np.float32))
        text = '[source]\nreference="source.ply"\nframes="take.npy"\nfps=30\n[target]\nreference="target.ply"\n'
        (folder / "shot.toml").write_text(text + "[bases]\ncount=4\n")
        run_stages(Shot(folder))
        _finished["shot"] = folder
    own = tmp_path / "shot"
    shutil.copytree(_finished["shot"], own)
    return Shot(own)


class Hand:
    """Drives an `App` as a user does: it points at vertices of a pane's face, and waits for the worker."""

    SIZE = (700, 700)

    def __init__(self, app: App) -> None:
        self.app = app
        self._last = (0.0, 0.0)
        self._travel = 0.0

    def wait(self) -> None:
        while self.app.busy:
            self.app.worker.wait(30)
            self.app.tick(0.0)

    def pixel(self, place: np.ndarray, pane: int = 1) -> tuple[float, float]:
        x, y, _ = self.app.framing_camera(pane).project(np.asarray(place)[None], self.SIZE)[0]
        return float(x), float(y)

    def pixel_of(self, vertex: int, pane: int = 1) -> tuple[float, float]:
        return self.pixel(self.app.surface(pane).vertices[vertex], pane)

    def event(self, kind: str, x: float, y: float, pane: int = 1, **more) -> Pointer:
        camera = self.app.framing_camera(pane)
        origin, direction = pixel_ray(camera, x, y, self.SIZE)
        height = self.SIZE[1]
        moved = ((x - self._last[0]) / height, (self._last[1] - y) / height)
        self._travel = 0.0 if kind == "press" else self._travel + float(np.hypot(*moved))
        self._last = (x, y)
        picker = Picker(self.app.surface(pane).vertices, self.app.surface(pane).triangles)
        return Pointer(
            kind,
            pane,
            origin=tuple(map(float, origin)),
            direction=tuple(map(float, direction)),
            hit=picker.pick(camera, x, y, self.SIZE),
            moved=moved,
            travel=self._travel,
            **more,
        )

    def send(self, kind: str, x: float, y: float, pane: int = 1, **more) -> None:
        self.app.handle(self.event(kind, x, y, pane, **more))

    def drag(self, start: tuple[float, float], end: tuple[float, float], pane: int = 1, steps: int = 5, **more) -> None:
        self.send("press", *start, pane, **more)
        for share in np.linspace(0, 1, steps + 1)[1:]:
            at = (1 - share) * np.asarray(start) + share * np.asarray(end)
            self.send("drag", float(at[0]), float(at[1]), pane, **more)
            self.app.tick(0.01)
        self.send("release", *end, pane, **more)
        self.wait()

    def click(self, vertex: int, pane: int = 1, **more) -> None:
        at = self.pixel_of(vertex, pane)
        self.send("press", *at, pane, **more)
        self.send("release", *at, pane, **more)
        self.wait()


@pytest.fixture
def workers() -> Iterator[list[Worker]]:
    started: list[Worker] = []
    yield started
    for worker in started:
        worker.stop()


@pytest.fixture
def opened(workers: list[Worker]) -> Callable[[Shot], Hand]:
    """``opened(shot)``: the application on a shot, its edit session open."""

    def start(shot: Shot) -> Hand:
        worker = Worker()
        workers.append(worker)
        hand = Hand(App(shot, worker))
        hand.app.pane_sizes = [Hand.SIZE, Hand.SIZE]
        hand.wait()
        assert hand.app.editing.session is not None, hand.app.editing.problem
        return hand

    return start


@pytest.fixture
def hand(shot: Shot, opened: Callable[[Shot], Hand]) -> Hand:
    return opened(shot)


@pytest.fixture
def pose(hand: Hand) -> Hand:
    """The hand of a user in the pose edit mode, at the key frame."""
    hand.app.choose_mode("pose")
    hand.app.go_to_frame(KEY)
    hand.wait()
    return hand


def edits(shot: Shot) -> tuple:
    """What is in the journal."""
    return Journal(shot.edits_path).replay().edits
