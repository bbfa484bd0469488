#!/usr/bin/env python3
"""How long stages 2 to 5 take, stage by stage, and how much memory, beside the time to read and write the same bytes.

The performance is the ICT performer's (``--ict FOLDER``: the folder with its bake.py) or the project's own sample,
resampled to the frames asked for. The target is the same mesh, stretched, so that no registration is in the way.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._scale.runs import read_write_floor, run_measured, write_config, write_inputs, write_shot  # noqa: E402
from benchmarks._scale.takes import LEVELS  # noqa: E402
from toolkit.feature_lines import load_feature_lines, trace_lines  # noqa: E402
from toolkit.mesh import TriangleMesh  # noqa: E402
from toolkit.shot import Shot  # noqa: E402

_COLD_GOAL = 20


def main() -> int:
    """Build the shot, run it in a process of its own, print the table."""
    options = _parser().parse_args()
    with tempfile.TemporaryDirectory(prefix="mien_benchmark_", dir=options.work) as folder:
        shot = Path(folder)
        if options.ict:
            _ict(shot, options)
        else:
            write_shot(shot, LEVELS[options.level], options.frames, options.bases)
        n_vertices = np.load(Shot(shot).config.source.frames, mmap_mode="r").shape[1]
        run_measured(shot)  # compiles, and warms the file cache
        runs = sorted((run_measured(shot) for _ in range(options.runs)), key=lambda run: run.total_s)
        floor = read_write_floor(shot)
        cold = _first_and_second(shot) if options.cold else None
    run = runs[len(runs) // 2]
    print(f"{n_vertices:,} vertices, {options.frames} frames, K = {run.bases}, median of {len(runs)} runs")
    for name, seconds in run.stages.items():
        print(f"  {name:<10} {seconds:7.2f} s   CPU {run.stages_cpu[name]:6.2f} s")
    print(f"  {'total':<10} {run.total_s:7.2f} s   CPU {run.cpu_s:6.2f} s")
    print(f"  peak memory {run.own_gb:.2f} GB of its own, {run.peak_gb:.2f} GB with mapped files")
    print(f"  reading and writing the same bytes: {floor:.2f} s; total is {run.total_s / floor:.1f} times that")
    data = {**run.data(), "floor_s": floor, "vertices": n_vertices, "frames": options.frames}
    if cold:
        first, again = cold
        more = first - again
        print(f"  with reading and checking, a first run takes {first:.1f} s, a second {again:.1f} s: ", end="")
        print(f"{more:.1f} s to compile (goal: {_COLD_GOAL})  {'PASS' if more <= _COLD_GOAL else 'FAIL'}")
        data |= {"first_run_s": first, "second_run_s": again}
    if options.json:
        print(json.dumps(data))
    return 0


def _first_and_second(shot: Path) -> tuple[float, float]:
    """Seconds of the first run after installation, when nothing is compiled, and of the second; inputs included."""
    with tempfile.TemporaryDirectory(prefix="mien_compiled_") as compiled:
        runs = [run_measured(shot, Path(compiled)) for _ in range(2)]
    first, again = (run.inputs_s + run.total_s for run in runs)
    return first, again


def _ict(folder: Path, options: argparse.Namespace) -> None:
    inputs = folder / "inputs"
    bake = [sys.executable, str(options.ict / "bake.py"), str(inputs), "--frames", str(options.frames)]
    subprocess.run(bake, check=True)
    (inputs / "frames.npy").rename(inputs / "take.npy")
    mesh = TriangleMesh(
        np.load(inputs / "reference.npy").astype(float), np.load(inputs / "triangles.npy").astype(np.int32)
    )
    lines = trace_lines(load_feature_lines(options.ict / "feature_lines.json"), mesh.vertices, mesh.triangles)
    write_inputs(inputs, mesh, lines)
    write_config(folder, inputs, options.bases)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ict", type=Path, metavar="FOLDER", help="folder of the ICT performer; else the own sample")
    parser.add_argument("--level", type=int, default=2, choices=(0, 1, 2), help="resolution of the own sample (2)")
    parser.add_argument("--frames", type=int, default=363, help="number of frames (363)")
    parser.add_argument("--bases", type=int, default=10, help="number of bases K (10)")
    parser.add_argument("--runs", type=int, default=3, help="measured runs, the median is printed (3)")
    parser.add_argument("--cold", action="store_true", help="also time a first run, which compiles")
    parser.add_argument("--work", type=Path, help="where to put the temporary shot")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser


if __name__ == "__main__":
    sys.exit(main())
