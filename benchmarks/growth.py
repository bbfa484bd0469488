#!/usr/bin/env python3
"""How time and memory grow with vertices V, frames T and bases K, from decomposition to written frames.

The sample performer at several resolutions, every size in a fresh process, everything compiled before. An exponent p
says that time grows as the size to the power p: fitted over all sizes (least squares in logarithms), and from the last
two alone, where what does not grow counts least. CPU seconds are fitted: they mind other work on the machine less.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._scale.runs import Run, run_measured, warm_up, write_shot  # noqa: E402

_GOAL = 1.1
_LABELS = {"vertices": "V", "frames": "T", "bases": "K"}


def main() -> int:
    """Vary one size at a time, print the tables and the exponents."""
    options = _parser().parse_args()
    said: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="mien_growth_", dir=options.work) as folder:
        work = Path(folder)
        warm_up(work / "warm")
        base = {"vertices": options.at_vertices, "frames": options.at_frames, "bases": options.at_bases}
        for axis in ("vertices", "frames", "bases"):
            sizes = sorted(getattr(options, axis))
            if sizes:
                said[axis] = _vary(axis, sizes, base, work / "shot", options.runs)
    if options.json:
        print(json.dumps(said))
    return 0


def _vary(axis: str, sizes: Sequence[int], base: dict[str, int], shot: Path, runs: int) -> dict[str, Any]:
    others = ", ".join(f"{_LABELS[name]} = {size:,}" for name, size in base.items() if name != axis)
    print(f"\n{axis} {_LABELS[axis]}, with {others}")
    print(f"{_LABELS[axis]:>12}{'s':>9}{'CPU s':>9}{'own GB':>9}{'all GB':>9}", flush=True)
    measured: list[Run] = []
    for size in sizes:
        measured.append(_measured(base | {axis: size}, shot, runs))
        run = measured[-1]
        print(f"{size:>12,}{run.total_s:>9.2f}{run.cpu_s:>9.2f}{run.own_gb:>9.3f}{run.peak_gb:>9.3f}", flush=True)
    result: dict[str, Any] = {"sizes": list(sizes), "runs": [run.data() for run in measured], "exponents": {}}
    if len(sizes) > 1:
        for name, values in (
            ("time (CPU s)", [run.cpu_s for run in measured]),
            ("time (s)", [run.total_s for run in measured]),
            ("memory (own)", [run.own_gb for run in measured]),
        ):
            fitted, last = exponent(sizes, values), exponent(sizes[-2:], values[-2:])
            result["exponents"][name] = {"fitted": fitted, "last_two": last}
            goal = f"   goal {_GOAL}: {'PASS' if fitted <= _GOAL else 'FAIL'}" if _judged(axis, name) else ""
            print(f"  {name:<14} exponent {fitted:5.2f}, of the last two {last:5.2f}{goal}", flush=True)
    return result


def _judged(axis: str, name: str) -> bool:
    return axis in ("vertices", "frames") and name == "time (CPU s)"


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """``p`` of the best ``c size^p``, by least squares of logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def _measured(at: dict[str, int], shot: Path, runs: int) -> Run:
    """The run that took the least CPU time."""
    shot.mkdir()
    try:
        write_shot(shot, at["vertices"], at["frames"], at["bases"])
        return min((run_measured(shot) for _ in range(runs)), key=lambda run: run.cpu_s)
    finally:
        shutil.rmtree(shot)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    sizes = {
        "vertices": ([8_000, 16_000, 32_000, 64_000], "from 4,326 on"),
        "frames": ([60, 120, 240, 480], "frames"),
        "bases": ([5, 10, 20, 40], "bases"),
    }
    for name, (default, what) in sizes.items():
        shown = " ".join(map(str, default))
        parser.add_argument(
            f"--{name}", type=int, nargs="*", default=default, metavar=_LABELS[name], help=f"{what} ({shown})"
        )
    for name, size in (("vertices", 16_000), ("frames", 120), ("bases", 10)):
        parser.add_argument(
            f"--at-{name}", type=int, default=size, metavar="N", help=f"{name} while another varies ({size})"
        )
    parser.add_argument("--runs", type=int, default=2, help="runs of each size, the one with least CPU counts (2)")
    parser.add_argument("--work", type=Path, help="where to put the takes")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser


if __name__ == "__main__":
    sys.exit(main())
