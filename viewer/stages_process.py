"""Run stages in a process of their own: solvers that hold the interpreter's lock would freeze the window.

``python -m viewer.stages_process DIR [STAGE ...]`` writes a JSON line for each report of progress; `run_in_process` is
the caller's side. Stopping the process at any moment is safe, as every stage is written aside and renamed into place.
"""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

from toolkit.errors import InputError
from toolkit.progress import Progress

__all__ = ["run_in_process"]


def run_in_process(folder: Path, stages: Sequence[str], progress: Progress) -> list[dict[str, Any]]:
    """Run stages of the shot in ``folder`` and what they need; reports of each stage.

    Cancelling (``progress`` raises) ends the process. Raises InputError with the stage's own sentence.
    """
    command = [sys.executable, "-m", "viewer.stages_process", str(folder), *stages]
    root = Path(__file__).resolve().parent.parent
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=root, bufsize=1
    ) as child:
        try:
            return _listen(child, progress)
        finally:
            if child.poll() is None:
                child.terminate()


def _listen(child: subprocess.Popen[str], progress: Progress) -> list[dict[str, Any]]:
    if child.stdout is None or child.stderr is None:
        raise RuntimeError("the stages' process has no pipes")
    errors: deque[str] = deque(maxlen=8)
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    threading.Thread(target=_pass_on, args=(child.stdout, lines), daemon=True).start()
    reader = threading.Thread(target=errors.extend, args=(child.stderr,), daemon=True)
    reader.start()
    last: tuple[str, int, int] = ("starting", 0, 0)
    reports: list[dict[str, Any]] = []
    while True:
        try:
            line = lines.get(timeout=0.1)
        except queue.Empty:
            progress(*last)  # a chance to cancel while a solver is silent
            continue
        if line is None:
            break
        said = _read(line)
        if "progress" in said:
            last = tuple(said["progress"])
            progress(*last)
        elif "error" in said:
            raise InputError(said["error"].rstrip("."))
        elif "reports" in said:
            reports = said["reports"]
    code = child.wait()
    reader.join(timeout=1)
    if code:
        raise RuntimeError(f"the stages ended with code {code}: {' '.join(errors).strip()[-400:]}")
    return reports


def _pass_on(stream: IO[str], lines: queue.SimpleQueue[str | None]) -> None:
    for line in stream:
        lines.put(line)
    lines.put(None)


def _read(line: str) -> dict[str, Any]:
    try:
        said = json.loads(line)
    except ValueError:  # a library that prints
        return {}
    return said if isinstance(said, dict) else {}


def main(arguments: Sequence[str]) -> int:
    """The process's side."""
    from toolkit.shot import Shot
    from toolkit.stages import run_stages

    said = 0.0

    def progress(what: str, done: int, total: int) -> None:
        nonlocal said
        now = time.monotonic()
        if now - said > 0.05 or done >= total:
            said = now
            _say({"progress": [what, int(done), int(total)]})

    try:
        reports = run_stages(Shot(arguments[0]), list(arguments[1:]) or None, progress=progress)
    except InputError as error:
        _say({"error": str(error)})
        return 2
    _say({"reports": [vars(report) for report in reports]})
    return 0


def _say(words: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(words, default=str) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
