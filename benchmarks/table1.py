#!/usr/bin/env python3
"""The paper's Table 1: every row at its size, from decomposition to written frames, with the paper's time beside ours.

Each row is the sample performer with as many vertices, frames and bases as the paper's, onto a stretched copy of it, so
that no registration is in the way (the paper's times leave it out, too). It runs in a fresh process, which has read and
checked its inputs (--by-stage says how long that took); everything was compiled before. Two floors are measured in the
same run: reading the take and writing as many bytes, and the back-substitutions of the bases alone. "own" memory is
what the process allocated, "all" counts the mapped pages of files, which the system takes back when it needs them.

The paper's machine: Intel i7-2600, 3.4 GHz, 8 threads, 8 GB. With --share the takes are shorter; the seconds are then
those of the shorter take, and "full" is what they make for all frames in proportion, marked with ~ (too much, since
part of the time does not depend on the frames).
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._scale.runs import read_write_floor, run_measured, substitution_floor, warm_up, write_shot  # noqa: E402

_GOAL = 8


@dataclass(frozen=True)
class PaperRow:
    """A row of the paper's Table 1; ``seconds`` as printed there, in minutes."""

    name: str
    vertices: int
    frames: int
    bases: int
    seconds: float


ROWS = (
    PaperRow("Matt to Monster", 80_000, 363, 10, 60),
    PaperRow("Abu to Old Man", 80_000, 534, 12, 72),
    PaperRow("Robert to Monster", 80_000, 199, 6, 42),
    PaperRow("Abu to Dog1", 80_000, 1373, 28, 174),
    PaperRow("Max to Rejane", 30_000, 200, 5, 18),
    PaperRow("Abu to Dog2", 80_000, 308, 10, 66),
    PaperRow("Abu to Baby", 80_000, 1373, 30, 180),
    PaperRow("Abu to Nouillet", 80_000, 522, 10, 48),
    PaperRow("Man to Woman", 1_180_000, 348, 10, 492),
)
_HEAD = (
    f"{'row':<20}{'vertices':>10}{'frames':>8}{'K':>4}{'paper s':>9}{'ours s':>9}{'full s':>9}{'faster':>8}{'CPU s':>8}"
    f"{'own GB':>8}{'all GB':>8}{'x files':>9}{'x solves':>10}  goal"
)


def main() -> int:
    """Run the rows, print the table."""
    options = _parser().parse_args()
    chosen = [ROWS[number - 1] for number in options.rows]
    rows = []
    with tempfile.TemporaryDirectory(prefix="mien_table1_", dir=options.work) as folder:
        work = Path(folder)
        _check_space(work, chosen, options)
        warm_up(work / "warm")
        print(_HEAD, flush=True)
        for row in chosen:
            rows.append(_measured(row, work / "shot", options))
            print(_line(rows[-1]), flush=True)
            if options.by_stage:
                print(_stages(rows[-1]), flush=True)
    if options.share != 1:
        print("~ in proportion to the frames, from the shorter takes that were run")
    print(f"goal: at least {_GOAL} times as fast as the paper; x files, x solves: times the floors (see --help)")
    if options.json:
        print(json.dumps({"share": options.share, "vertices_share": options.vertices_share, "rows": rows}))
    return 0


def _measured(row: PaperRow, shot: Path, options: argparse.Namespace) -> dict[str, Any]:
    vertices = round(row.vertices * options.vertices_share)
    frames = max(round(row.frames * options.share), row.bases + 2)
    shot.mkdir()
    try:
        write_shot(shot, vertices, frames, row.bases, options.takes)
        run = min((run_measured(shot) for _ in range(options.runs)), key=lambda one: one.total_s)
        floors = read_write_floor(shot), substitution_floor(shot)
    finally:
        shutil.rmtree(shot)
    return {
        "name": row.name,
        "vertices": vertices,
        "frames": frames,
        "paper_frames": row.frames,
        "paper_s": row.seconds,
        "full_s": run.total_s * row.frames / frames,
        "read_write_s": floors[0],
        "substitutions_s": floors[1],
        **run.data(),
    }


def _line(row: dict[str, Any]) -> str:
    full = f"{'~' if row['frames'] != row['paper_frames'] else ''}{row['full_s']:.1f}"
    faster = row["paper_s"] / row["full_s"]
    return (
        f"{row['name']:<20}{row['vertices']:>10,}{row['frames']:>8}{row['bases']:>4}{row['paper_s']:>9.0f}"
        f"{row['total_s']:>9.1f}{full:>9}{faster:>8.1f}{row['cpu_s']:>8.1f}{row['own_gb']:>8.2f}{row['peak_gb']:>8.2f}"
        f"{row['total_s'] / row['read_write_s']:>9.1f}{row['total_s'] / row['substitutions_s']:>10.1f}  "
        f"{'PASS' if faster >= _GOAL else 'FAIL'}"
    )


def _stages(row: dict[str, Any]) -> str:
    parts = [f"{name} {seconds:.1f} s (CPU {row['stages_cpu'][name]:.1f})" for name, seconds in row["stages"].items()]
    floors = f"floors {row['read_write_s']:.1f} s and {row['substitutions_s']:.1f} s"
    return f"    {', '.join(parts)}; {floors}; before that, reading and checking {row['inputs_s']:.1f} s"


def _check_space(folder: Path, rows: list[PaperRow], options: argparse.Namespace) -> None:
    """Five takes lie on the disk at a time: the take, two arrays of the decomposition, the result, the copy."""
    largest = max(row.vertices * options.vertices_share * row.frames * options.share for row in rows)
    need, free = 12 * 5.2 * largest / 2**30, shutil.disk_usage(folder).free / 2**30
    if need > free:
        sys.exit(
            f"error: the largest row needs {need:.0f} GiB of disk, {folder} has {free:.0f}; give --work or --share"
        )


def _row_numbers(text: str) -> list[int]:
    try:
        numbers = [int(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if not numbers or not all(1 <= number <= len(ROWS) for number in numbers):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of rows such as 1,5 (1 to {len(ROWS)})")
    return numbers


def _parser() -> argparse.ArgumentParser:
    listed = "\n".join(f"  {k} {r.name}: {r.vertices:,} x {r.frames} x {r.bases}" for k, r in enumerate(ROWS, 1))
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=f"rows:\n{listed}", formatter_class=argparse.RawDescriptionHelpFormatter
    )
    everything = list(range(1, len(ROWS) + 1))
    parser.add_argument("--rows", type=_row_numbers, default=everything, metavar="N,N", help="which rows (all)")
    parser.add_argument("--share", type=float, default=1.0, help="share of the frames to run (1)")
    parser.add_argument("--vertices-share", type=float, default=1.0, help="share of the vertices, for a quick look (1)")
    parser.add_argument("--runs", type=int, default=1, help="runs of each row, the fastest counts (1)")
    parser.add_argument("--work", type=Path, help="where to put the takes; up to 26 GiB for the last row")
    parser.add_argument("--takes", type=Path, metavar="DIR", help="keep the takes here for the next time (9 GiB)")
    parser.add_argument("--by-stage", action="store_true", help="say under each row what each stage took")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser


if __name__ == "__main__":
    sys.exit(main())
