"""A user at a desk: an X server without a screen, the viewer in a process of its own, real pointer and key events."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from benchmarks._viewer.screen import Screen, screen
from data.samples import SamplePaths, build_samples
from toolkit.shot import Shot, ShotConfig, SourceInput, TargetInput, save_config
from toolkit.stages import run_stages
from viewer.state.cameras import Framing, Viewpoint

ROOT = Path(__file__).resolve().parents[3]
PATIENCE = 90.0


@pytest.fixture(scope="session")
def xserver(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Screen]:
    """A screen that nobody sees."""
    missing = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    if missing:
        words = f"{' and '.join(missing)} missing: apt-get install -y xvfb xdotool"
        if os.environ.get("CI"):
            pytest.fail(words)
        pytest.skip(words)
    with screen(tmp_path_factory.mktemp("screen"), (1280, 900)) as shown:
        yield shown


class Desk:
    """The viewer on one shot, and the hands of its user. Places are pixels of a pane or of the window."""

    def __init__(self, shot: Path, shown: Screen, folder: Path, size: tuple[int, int]) -> None:
        self.shot, self._shown, self._folder = shot, shown, folder
        self._state_file, self._log = folder / "state.json", folder / "viewer.log"
        own = {"DISPLAY": shown.display, "OMP_NUM_THREADS": "1", "XDG_RUNTIME_DIR": str(folder)}
        self._environment = {**os.environ, **own}
        self._state_file.unlink(missing_ok=True)
        command = [sys.executable, "-m", "viewer", str(shot), "--state", str(self._state_file)]
        command += ["--size", f"{size[0]}x{size[1]}", "--record", str(folder / "events.jsonl")]
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                command, cwd=ROOT, env={**self._environment, "MIEN_NO_PROBE": "1"}, stdout=log, stderr=log
            )
        self.wait(lambda state: state["warm"])
        time.sleep(0.3)
        self._window = self._xdotool("search", "--name", "^Mien").split()[0]

    # -- what is seen ---------------------------------------------------------------------------------------------

    @property
    def state(self) -> dict[str, Any]:
        return json.loads(self._state_file.read_text())

    def wait(self, wanted: Callable[[dict[str, Any]], bool] = lambda state: True) -> dict[str, Any]:
        """Until nothing runs and ``wanted(state)``."""
        until = time.monotonic() + PATIENCE
        state: dict[str, Any] = {}
        while time.monotonic() < until:
            if self.process.poll() is not None:
                pytest.fail(f"the viewer ended with {self.process.returncode}: {self._log.read_text()[-1500:]}")
            if self._state_file.exists():
                state = self.state
                if not state["busy"] and wanted(state):
                    return state
            time.sleep(0.03)
        self.picture("timeout")
        raise TimeoutError(f"the viewer did not come to that: {state}; {self._log.read_text()[-800:]}")

    def pixel(self, pane: int, place: np.ndarray, framing: Framing) -> tuple[int, int]:
        """Where a place is seen, in the window."""
        state = self.state
        view = state["views"][0 if state["linked"] else pane]
        camera = Viewpoint(**{**view, "shift": tuple(view["shift"])}).camera(framing)
        left, top, width, height = state["panes"][pane]
        x, y, _ = camera.project(np.asarray(place, dtype=float)[None], (width, height))[0]
        return left + int(x), top + int(y)

    def picture(self, name: str) -> np.ndarray:
        """A screenshot (h, w, 3), kept as a file; the renderer has to catch up first."""
        time.sleep(0.4)
        image = self._shown.grab()
        folder = Path(os.environ.get("MIEN_SCREENSHOTS", self._folder))
        folder.mkdir(parents=True, exist_ok=True)
        Image.fromarray(image).save(folder / f"{name}.png")
        return image

    # -- hands ----------------------------------------------------------------------------------------------------

    def _xdotool(self, *words: object) -> str:
        command = ["xdotool", *map(str, words)]
        return subprocess.run(command, env=self._environment, check=True, capture_output=True, text=True).stdout

    def enter(self, key: str, mode: str, widget: str = "") -> None:
        """The mode behind a key, once the shot can be edited; until its panel shows a ``widget``, if one is named."""
        self.wait(lambda state: state["editable"])
        self.key(key)
        self.wait(lambda state: state["mode"] == mode and (not widget or widget in state["widgets"]))

    def move(self, x: float, y: float) -> None:
        self._xdotool("mousemove", "--window", self._window, int(x), int(y))
        time.sleep(0.05)

    def click(self, x: float, y: float, button: int = 1) -> None:
        self.move(x, y)
        self._xdotool("mousedown", button)
        time.sleep(0.08)
        self._xdotool("mouseup", button)
        time.sleep(0.12)

    def press(self, x: float, y: float) -> None:
        self.move(x, y)
        self._until_told('"press"', lambda: self._xdotool("mousedown", 1))

    def lift(self) -> None:
        self._until_told('"release"', lambda: self._xdotool("mouseup", 1))

    def _until_told(self, words: str, act: Callable[[], object], patience: float = 3.0) -> bool:
        """Act, and wait until the viewer has done an event with these words: a busy machine takes its time."""
        before, until = self._told(words), time.monotonic() + patience
        act()
        while self._told(words) == before:
            if time.monotonic() > until:
                return False
            time.sleep(0.02)
        begun = time.time_ns()
        while self._state_file.stat().st_mtime_ns < begun and time.monotonic() < until:
            time.sleep(0.02)
        return True

    def _told(self, words: str) -> int:
        return (self._folder / "events.jsonl").read_text().count(words)

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 6) -> None:
        self.press(*start)
        for share in np.linspace(0, 1, steps + 1)[1:]:
            self.move(*((1 - share) * np.asarray(start) + share * np.asarray(end)))
        self.lift()

    def key(self, *names: str) -> None:
        for name in names:
            self._xdotool("key", name)
            time.sleep(0.12)

    def button(self, name: str) -> None:
        """Click the panel's widget of that name."""
        self.wait(lambda state: name in state["widgets"])
        for _ in range(3):  # a press and a release within one picture of a slow renderer are no click for it
            time.sleep(0.5)  # the panel may just be laid out again
            x, y, width, height = self.state["widgets"][name]
            if self._until_told(f'"name": "{name}"', lambda: self.click(x + min(width // 2, 12), y + height // 2)):  # noqa: B023
                return
        raise AssertionError(f"the button {name} cannot be clicked")

    def resize(self, width: int, height: int) -> None:
        self._xdotool("windowsize", self._window, width, height)

    def close(self) -> None:
        """As the window's frame does it; without a window manager nobody else asks."""
        self.key("ctrl+q")
        assert self.process.wait(30) == 0, self._log.read_text()[-1500:]

    def kill(self) -> None:
        self.process.kill()
        self.process.wait(10)
        self._xdotool("mouseup", 1)  # else the next viewer finds the button down


@pytest.fixture
def sit_down(xserver: Screen, tmp_path: Path) -> Iterator[Callable[..., Desk]]:
    """``sit_down(shot)``: open the viewer."""
    desks: list[Desk] = []

    def start(shot: Path, size: tuple[int, int] = (1200, 800)) -> Desk:
        folder = tmp_path / f"desk{len(desks)}"
        folder.mkdir()
        desks.append(Desk(shot, xserver, folder, size))
        return desks[-1]

    yield start
    for desk in desks:
        if desk.process.poll() is None:
            desk.kill()


@pytest.fixture(scope="session")
def samples(tmp_path_factory: pytest.TempPathFactory, xserver: Screen, wheel: Path) -> SamplePaths:
    """The coarsest samples."""
    return build_samples(tmp_path_factory.mktemp("samples"), lambda *_: None, ["asian_female"], 0)


def _new_shot(folder: Path, samples: SamplePaths) -> Path:
    folder.mkdir()
    performer, target = samples.performer, samples.targets["asian_female"]
    frames = folder / "take.npy"
    np.save(frames, np.load(performer.frames)[::3])
    source = SourceInput(performer.reference, frames, performer.fps / 3)
    save_config(folder / "shot.toml", ShotConfig(source, TargetInput(target.reference)))
    return folder


@pytest.fixture
def raw_shot(samples: SamplePaths, tmp_path: Path) -> Path:
    """A shot of which nothing has been run, with all but the last of its landmarks."""
    folder = _new_shot(tmp_path / "raw", samples)
    known = json.loads(samples.targets["asian_female"].landmarks.read_text())
    (folder / "landmarks.json").write_text(json.dumps({"pairs": known["pairs"][:-1]}))
    return folder


@pytest.fixture(scope="session")
def finished(samples: SamplePaths, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = _new_shot(tmp_path_factory.mktemp("shots") / "sample", samples)
    target = samples.targets["asian_female"]
    shutil.copyfile(target.landmarks_head, folder / "landmarks.json")
    shutil.copyfile(target.feature_lines, folder / "feature_lines.json")
    run_stages(Shot(folder))
    return folder


@pytest.fixture
def shot(finished: Path, tmp_path: Path) -> Path:
    """A finished shot of its own."""
    return Path(shutil.copytree(finished, tmp_path / "sample"))
