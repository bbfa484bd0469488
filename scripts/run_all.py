#!/usr/bin/env python3
"""Steps 1 to 5: from a shot's files to result/frames.npy, skipping what is up to date."""

from __future__ import annotations

import argparse
import sys
from typing import Any

from _cli import parser_for, print_stages, run
from _workers import add_workers, frame_workers

from toolkit.progress import Progress


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Run all stages."""
    from toolkit.shot import Shot
    from toolkit.stages import run_stages

    shot = Shot(options.shot)
    with frame_workers(options, [shot.path]) as map_blocks:
        reports = run_stages(shot, force=options.force, progress=progress, map_blocks=map_blocks)
    print_stages(reports)
    print(f"result: {shot.frames_path}")
    seconds = {report.stage: report.seconds for report in reports}
    numbers = {report.stage: report.numbers for report in reports}
    return {"result": str(shot.frames_path), "total_s": sum(seconds.values()), "stages": seconds, "numbers": numbers}


if __name__ == "__main__":
    made = parser_for(__doc__)
    made.add_argument("--force", action="store_true", help="run every step anew")
    add_workers(made)
    sys.exit(run(made, main))
