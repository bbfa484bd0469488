"""Run stages and exports in a process of their own: solvers that hold the interpreter's lock would freeze the window.

``python -m viewer.stages_process DIR stages|export [NAME ...]`` writes a JSON line for each report of progress;
`run_in_process` and `export_in_process` are the caller's side. Stopping the process at any moment is safe, as every
stage is written aside and renamed into place.
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
from toolkit.shot import Shot
from toolkit.stages import run_stages

__all__ = ["export_in_process", "run_in_process"]


def run_in_process(folder: Path, stages: Sequence[str], progress: Progress) -> list[dict[str, Any]]:
    """Run stages of the shot in ``folder`` and what they need; reports of each stage.

    Cancelling (``progress`` raises) ends the process. Raises InputError with the stage's own sentence.
    """
    return _call(folder, "stages", stages, progress)


def export_in_process(folder: Path, formats: Sequence[str], progress: Progress) -> list[dict[str, Any]]:
    """Bring the result up to date, edits included, and export it; a report (`ExportReport`) for each format."""
    return _call(folder, "export", formats, progress)


def _call(folder: Path, what: str, names: Sequence[str], progress: Progress) -> list[dict[str, Any]]:
    command = [sys.executable, "-m", "viewer.stages_process", str(folder.resolve()), what, *names]
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
    said = 0.0

    def progress(what: str, done: int, total: int) -> None:
        nonlocal said
        now = time.monotonic()
        if now - said > 0.05 or done >= total:
            said = now
            _say({"progress": [what, int(done), int(total)]})

    try:
        shot, what, names = Shot(arguments[0]), arguments[1], list(arguments[2:])
        reports: list[Any] = run_stages(shot, (names or None) if what == "stages" else None, progress=progress)
        if what == "export":
            reports = _export(shot, names, progress)
    except InputError as error:
        _say({"error": str(error)})
        return 2
    _say({"reports": [vars(report) for report in reports]})
    return 0


def _export(shot: Shot, formats: Sequence[str], progress: Progress) -> list[Any]:
    from toolkit.export import export, file_name
    from toolkit.stages.performance import load_performance

    performance = load_performance(shot)
    return [export(performance, shot.export_folder / file_name(performance, name), name, progress) for name in formats]


def _say(words: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(words, default=str) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
