#!/usr/bin/env python3
"""Step 7: write the result for other programs, into DIR/export/."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from _cli import parser_for, run
from _views import positive_number

from toolkit.progress import Progress

FORMATS = ("gltf", "usd", "abc", "pc2", "mdd", "obj", "ply", "npy")


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Export in every format asked for."""
    from toolkit.errors import InputError
    from toolkit.export import export, file_name
    from toolkit.shot import Shot
    from toolkit.stages.performance import load_performance

    if options.out is not None and len(options.format) > 1:
        raise InputError("--out goes with one --format", remedy="export one format at a time, or leave --out away")
    shot = Shot(options.shot)
    performance = replace(load_performance(shot), metres_per_unit=options.metres_per_unit)
    exported = []
    for name in options.format:
        path = options.out or shot.export_folder / file_name(performance, name)
        report = export(performance, path, name, progress)
        line = f"{report.path}: {report.n_frames} frames, {report.n_bytes / 1e6:.1f} MB"
        if report.max_deviation:
            line += (
                f"; {len(performance.morphs)} morph targets differ from the frames by {report.rms_deviation:.3g} RMS"
            )
            line += f", {report.max_deviation:.3g} at most (the target's unit)"
        print(line)
        exported.append(report)
    return {"exports": [vars(report) for report in exported]}


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = parser_for(__doc__)
    made.add_argument("--format", choices=FORMATS, action="append", required=True, help="may be given several times")
    made.add_argument("--out", type=Path, help="file or folder to write instead (with one --format)")
    made.add_argument(
        "--metres-per-unit",
        metavar="M",
        type=positive_number,
        help="of the target's unit, for glTF and USD: 0.01 for centimetres",
    )
    return made


if __name__ == "__main__":
    sys.exit(run(parser(), main))
