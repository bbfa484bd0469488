#!/usr/bin/env python3
"""Make the pictures of the viewer in docs/: opens a finished shot under an X server of its own and plays events.

    python docs/viewer_pictures.py SHOT        (writes docs/viewer_*.jpg; needs Xvfb)

SHOT may be `demo/asian_female`; it is copied first, and nothing is written to it.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

SIZE = (1600, 980)
DISPLAY = ":97"


def events(shot: Path) -> dict[str, list[dict[str, Any]]]:
    """The events that lead to each picture."""
    from toolkit.shot import Shot
    from toolkit.stages.inputs import load_landmark_pairs
    from viewer.state.shot_data import ShotData

    opened = Shot(shot)
    marks = load_landmark_pairs(opened)
    vertex = {name: int(v) for name, v in zip(marks.names, marks.source, strict=True)}
    corner = next(v for name, v in vertex.items() if "corner" in name and "mouth" in name)
    wrinkled = int(np.argmax(np.array(opened.array("decompose", "detail_energy"))))
    pull = 0.03 * ShotData(opened).target_framing.height
    turned = {"azimuth": -24.0, "elevation": 6.0, "distance": 2.6}
    close = {"azimuth": 14.0, "elevation": 2.0, "distance": 2.1, "shift": [0.0, -0.03, 0.0]}

    def command(name: str, argument: Any = None) -> dict[str, Any]:
        return {"event": "command", "name": name, "argument": argument}

    return {
        "viewer_performance": [command("frame", wrinkled), command("view", turned)],
        "viewer_landmarks": [command("mode", "landmarks"), command("pair", "registration"), command("view", turned)],
        "viewer_pose": [
            command("mode", "pose"),
            command("frame", wrinkled),
            command("view", close),
            {"event": "pointer", "kind": "press", "pane": 1, "vertex": corner},
            {"event": "pointer", "kind": "release", "pane": 1, "vertex": corner},
            {"wait": 1},
            {"event": "panel", "name": "dx", "value": 0.6 * pull},
            {"wait": 1},
            {"event": "panel", "name": "dy", "value": pull},
            {"wait": 3},
            command("pair", "before_after"),
        ],
    }


def grab(buffer: Path) -> Image.Image:
    """The X server's picture."""
    data = buffer.read_bytes()
    header = struct.unpack(">25I", data[:100])
    start, width, height, row = header[0] + 12 * header[19], header[4], header[5], header[12]
    pixels = np.frombuffer(data, np.uint8, row * height, start).reshape(height, row)[:, : 4 * width]
    return Image.fromarray(np.ascontiguousarray(pixels.reshape(height, width, 4)[..., 2::-1]))


def picture(shot: Path, lines: list[dict[str, Any]], out: Path, folder: Path) -> None:
    """Play ``lines`` on the shot and save what is seen then."""
    script, state = folder / "events.jsonl", folder / "state.json"
    state.unlink(missing_ok=True)
    script.write_text("".join(json.dumps(line) + "\n" for line in [*lines, {"wait": 6}]))
    command = [sys.executable, "-m", "viewer", str(shot), "--script", str(script), "--state", str(state)]
    command += ["--size", f"{SIZE[0]}x{SIZE[1]}"]
    environment = {**os.environ, "DISPLAY": DISPLAY, "MIEN_NO_PROBE": "1", "XDG_RUNTIME_DIR": str(folder)}
    viewer = subprocess.Popen(command, cwd=ROOT, env=environment)
    try:
        settled, until = 0, time.monotonic() + 300
        while settled < 6 and viewer.poll() is None and time.monotonic() < until:
            time.sleep(1)
            known = json.loads(state.read_text()) if state.exists() else {"busy": True, "script": True}
            settled = settled + 1 if not known["busy"] and not known["script"] else 0
        if viewer.poll() is not None:
            raise RuntimeError(f"the viewer ended with {viewer.returncode} before the picture {out.name} was made")
        grab(folder / "Xvfb_screen0").crop((0, 0, *SIZE)).save(out, quality=88)
        sys.stdout.write(f"{out}\n")
    finally:
        viewer.kill()
        viewer.wait()


def main() -> int:
    """Copy the shot, start the server, take the pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shot", type=Path)
    parser.add_argument("--out", type=Path, default=ROOT / "docs")
    parser.add_argument("--only", help="one of the pictures")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shot = Path(shutil.copytree(options.shot, folder / options.shot.resolve().name))
        screen = ["-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24", "-fbdir", str(folder), "-noreset"]
        server = subprocess.Popen(["Xvfb", DISPLAY, *screen], stderr=subprocess.DEVNULL)
        try:
            time.sleep(2)
            for picture_name, lines in events(shot).items():
                if options.only in (None, picture_name):
                    picture(shot, lines, options.out / f"{picture_name}.jpg", folder)
        finally:
            server.terminate()
    return 0


if __name__ == "__main__":
    sys.exit(main())
