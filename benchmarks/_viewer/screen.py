"""A screen that nobody sees: an X server with a frame buffer in a file, and the viewer playing a script on it."""

from __future__ import annotations

import json
import os
import random
import struct
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Screen", "play_script", "screen"]

ROOT = Path(__file__).resolve().parents[2]
_PATIENCE = 300.0
_TRIES = 20


@dataclass(frozen=True)
class Screen:
    """``display`` for DISPLAY, ``buffer`` the file that holds what is seen."""

    display: str
    buffer: Path

    def set_density(self, dpi: int) -> None:
        """What a desktop would tell programs of its screen; needs xprop."""
        told = ["-format", "RESOURCE_MANAGER", "8s", "-set", "RESOURCE_MANAGER", f"Xft.dpi:\t{dpi}\n"]
        subprocess.run(["xprop", "-root", *told], env={**os.environ, "DISPLAY": self.display}, check=True)

    def grab(self) -> NDArray[np.uint8]:
        """The picture ``(h, w, 3)``."""
        data = self.buffer.read_bytes()
        header = struct.unpack(">25I", data[:100])
        start, width, height, row = header[0] + 12 * header[19], header[4], header[5], header[12]
        pixels = np.frombuffer(data, np.uint8, row * height, start).reshape(height, row)[:, : 4 * width]
        return np.ascontiguousarray(pixels.reshape(height, width, 4)[..., 2::-1])


@contextmanager
def screen(folder: Path, size: tuple[int, int]) -> Iterator[Screen]:
    """An X server of a size (width, height), with its buffer in ``folder``, until the block ends."""
    for number in random.SystemRandom().sample(range(100, 10000), _TRIES):
        # With -displayfd the server takes no lock, and another one may take its place.
        command = ["Xvfb", f":{number}", "-noreset", "-fbdir", str(folder)]
        command += ["-screen", "0", f"{size[0]}x{size[1]}x24"]
        server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        until = time.monotonic() + 20
        while server.poll() is None and time.monotonic() < until:
            if Path(f"/tmp/.X11-unix/X{number}").exists():
                try:
                    yield Screen(f":{number}", folder / "Xvfb_screen0")
                finally:
                    server.terminate()
                    server.wait(10)
                return
            time.sleep(0.05)
    raise RuntimeError("Xvfb does not start")


@contextmanager
def play_script(
    shot: Path, lines: Sequence[dict[str, Any]], shown: Screen, folder: Path, size: tuple[int, int], *words: str
) -> Iterator[dict[str, Any]]:
    """The viewer on a shot after ``lines`` of a script were played and all is quiet; what it says of itself then."""
    script, state = folder / "events.jsonl", folder / "state.json"
    state.unlink(missing_ok=True)
    script.write_text("".join(json.dumps(line) + "\n" for line in lines))
    command = [sys.executable, "-m", "viewer", str(shot), "--script", str(script), "--state", str(state)]
    command += ["--size", f"{size[0]}x{size[1]}", *words]
    environment = {**os.environ, "DISPLAY": shown.display, "MIEN_NO_PROBE": "1", "XDG_RUNTIME_DIR": str(folder)}
    viewer = subprocess.Popen(command, cwd=ROOT, env=environment)
    try:
        yield _settled(viewer, state)
    finally:
        viewer.kill()
        viewer.wait()


def _settled(viewer: subprocess.Popen[bytes], state: Path) -> dict[str, Any]:
    quiet, until = 0, time.monotonic() + _PATIENCE
    while time.monotonic() < until:
        time.sleep(0.5)
        if viewer.poll() is not None:
            raise RuntimeError(f"the viewer ended with {viewer.returncode} before its script did")
        known: dict[str, Any] = json.loads(state.read_text()) if state.exists() else {"busy": True, "script": True}
        quiet = quiet + 1 if not known["busy"] and not known["script"] else 0
        if quiet == 6:
            return known
    raise TimeoutError("the viewer's script did not come to its end")
