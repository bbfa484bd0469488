#!/usr/bin/env python3
"""Make the pictures of the viewer in docs/: opens a finished shot under an X server of its own and plays events.

    python docs/viewer_pictures.py SHOT        (writes docs/viewer_*.jpg; needs Xvfb)

SHOT may be `demo/asian_female`; it is copied first, and nothing is written to it.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

from benchmarks._viewer.screen import play_script, screen  # noqa: E402

SIZE = (1600, 980)


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
        with screen(folder, SIZE) as shown:
            for picture_name, lines in events(shot).items():
                if options.only not in (None, picture_name):
                    continue
                out = options.out / f"{picture_name}.jpg"
                with play_script(shot, [*lines, {"wait": 6}], shown, folder, SIZE):
                    Image.fromarray(shown.grab()).save(out, quality=88)
                sys.stdout.write(f"{out}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
