"""``python -m viewer SHOT``: see both faces, pick, drag, paint, and watch the performance follow."""

from __future__ import annotations

import argparse
import gc
import logging
import os
import sys
from pathlib import Path

from toolkit.errors import InputError

__all__ = ["main"]


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m viewer", description=__doc__)
    made.add_argument("shot", metavar="SHOT", type=Path, help="the shot folder, finished or not (scripts/new_shot.py)")
    made.add_argument("--script", type=Path, metavar="FILE", help="replay events from a file of JSON lines")
    made.add_argument("--record", type=Path, metavar="FILE", help="write every event to a file of JSON lines")
    made.add_argument("--state", type=Path, metavar="FILE", help="keep what is shown in a JSON file, for tests")
    made.add_argument("--size", type=_size, metavar="WxH", help="of the window, in pixels (1500x920 on a plain screen)")
    made.add_argument("-v", "--verbose", action="store_true", help="say more")
    return made


def main(arguments: list[str] | None = None) -> int:
    """Open the shot and show it; 0 when the window was closed, 2 for bad input or a missing display."""
    options = parser().parse_args(arguments)
    level = logging.INFO if options.verbose else logging.WARNING
    logging.basicConfig(level=level, format="%(levelname)s %(message)s", stream=sys.stderr)
    from viewer.display import Probe

    try:
        probe = Probe()
        return _show(options, probe)
    except InputError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2


def _show(options: argparse.Namespace, probe: object) -> int:
    from toolkit.shot import Shot
    from viewer.script import Player, Recorder
    from viewer.state.app import App
    from viewer.worker import Worker

    shot = Shot(options.shot)
    player = Player(options.script) if options.script else None
    recorder = Recorder(options.record) if options.record else None
    worker = Worker()
    app = App(shot, worker)
    try:
        probe.check()  # type: ignore[attr-defined]
        from viewer.view.window import Window

        window = Window(app, options.size, player, recorder, options.state)
        # A search for garbage through all that the libraries brought holds the window for a fifth of a second.
        gc.collect()
        gc.freeze()
        window.run()
    finally:
        app.saver.flush()
        worker.stop()
    return 0


def _size(text: str) -> tuple[int, int]:
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 1500x920") from None
    if width < 640 or height < 480:
        raise argparse.ArgumentTypeError(f"{text} is too small; 640x480 is the least")
    return width, height


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # Everything that counts is on disk by now, and taking Open3D's threads down can hang or crash.
    os._exit(code)
