"""Shots for the benchmarks of speed, run in processes of their own, with their time and memory."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks._scale.takes import LEVELS, performer_at
from toolkit.feature_lines import FeatureLine, save_feature_lines
from toolkit.mesh import TriangleMesh
from toolkit.meshio import cache_as_npy, open_sequence, write_mesh
from toolkit.meshio.aside import folder_aside
from toolkit.shot import Shot

__all__ = [
    "ROOT",
    "Run",
    "read_write_floor",
    "run_measured",
    "substitution_floor",
    "warm_up",
    "write_config",
    "write_inputs",
    "write_shot",
]

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Run:
    """Stages 2 to 5 in a fresh process, without an earlier result, after the inputs were checked there (``inputs_s``).

    ``own_gb`` is the most memory of its own that the process had (what it allocated), ``peak_gb`` with the pages of
    mapped files that the system gives back when it needs them (GiB); ``own_gb`` is NaN where the system does not tell.
    """

    total_s: float
    cpu_s: float
    stages: dict[str, float]
    stages_cpu: dict[str, float]
    bases: int
    own_gb: float
    peak_gb: float
    inputs_s: float

    def data(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def write_shot(folder: Path, n_vertices: int, n_frames: int, n_bases: int, kept: Path | None = None) -> None:
    """A shot of the performer onto a stretched copy of it, so that no registration is in the way.

    ``kept`` is a folder where its files stay for the next shot of this size, or were left by an earlier one.
    """
    inputs = kept / f"{n_vertices}x{n_frames}" if kept else folder / "inputs"
    if not inputs.exists():
        performer = performer_at(n_vertices)
        with folder_aside(inputs) as aside:
            performer.write_take(aside / "take.npy", n_frames)
            write_inputs(aside, performer.mesh, performer.lines())
    write_config(folder, inputs, n_bases)


def write_inputs(folder: Path, mesh: TriangleMesh, lines: list[FeatureLine]) -> None:
    """All of a shot's files but ``take.npy``; the target is the source stretched."""
    write_mesh(folder / "source.ply", mesh)
    write_mesh(folder / "target.ply", mesh.with_vertices(mesh.vertices * [1.12, 0.95, 1.05]))
    save_feature_lines(folder / "feature_lines.json", lines)


def write_config(folder: Path, inputs: Path, n_bases: int) -> None:
    """Make a shot of the files in ``inputs``."""
    shutil.copyfile(inputs / "feature_lines.json", folder / "feature_lines.json")
    place = inputs.resolve().as_posix()
    (folder / "shot.toml").write_text(
        f'[source]\nreference = "{place}/source.ply"\nframes = "{place}/take.npy"\nfps = 30\n'
        f'[target]\nreference = "{place}/target.ply"\n[bases]\nthreshold = 1e-6\ncount = {n_bases}\n',
        encoding="utf-8",
    )


def run_measured(shot: Path, compiled: Path | None = None) -> Run:
    """Run the stages from decomposition to written frames in a fresh process.

    ``compiled`` is the folder for numba's compiled code, if it is not the usual one.
    """
    said, own, peak = _child("stages", shot, **({"NUMBA_CACHE_DIR": str(compiled)} if compiled else {}))
    names = ("total_s", "cpu_s", "stages", "stages_cpu", "bases", "inputs_s")
    return Run(**{name: said[name] for name in names}, own_gb=own, peak_gb=peak)


def substitution_floor(shot: Path) -> float:
    """Seconds of the back-substitutions alone, in a fresh process, for a shot that was run."""
    return float(_child("substitutions", shot)[0]["seconds"])


def read_write_floor(shot: Path) -> float:
    """Seconds to read the shot's take once and to write as many bytes to the disk; the copy is removed."""
    take, copy = open_sequence(Shot(shot).config.source.frames), shot / "copy.npy"
    began = time.perf_counter()
    cache_as_npy(take, copy)
    seconds = time.perf_counter() - began
    copy.unlink()
    return seconds


def warm_up(folder: Path) -> None:
    """Run a small shot once, so that everything is compiled."""
    folder.mkdir()
    write_shot(folder, LEVELS[0], 40, 3)
    run_measured(folder)


def _child(task: str, shot: Path, **environment: str) -> tuple[dict[str, Any], float, float]:
    """What ``benchmarks._scale.child`` says, and the most memory that it had: its own, and all (GiB)."""
    command = [sys.executable, "-m", "benchmarks._scale.child", task, str(shot)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT, env=os.environ | environment)
    peaks = [0.0]
    watch = threading.Thread(target=_watch_memory, args=(process, peaks))
    watch.start()
    out = process.communicate()[0]
    watch.join()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    said = json.loads(out.splitlines()[-1])
    return said, peaks[0] if peaks[0] else float("nan"), said["peak_gb"]


def _watch_memory(process: subprocess.Popen[str], peaks: list[float]) -> None:
    """Look from outside, fifty times a second, how much memory is the process's own (Linux)."""
    status = Path(f"/proc/{process.pid}/status")
    while process.poll() is None:
        try:
            lines = status.read_text(encoding="ascii").splitlines()
        except OSError:
            return
        sizes = {line.split(":")[0]: line.split()[1] for line in lines if line.startswith(("RssAnon", "RssShmem"))}
        peaks[0] = max(peaks[0], sum(int(size) for size in sizes.values()) / 2**20)
        time.sleep(0.02)
