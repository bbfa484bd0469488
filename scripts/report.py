#!/usr/bin/env python3
"""One HTML page about a shot: pictures, curves, numbers, and how to judge them. No display needed."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from _cli import parser_for, run
from _views import add_axes, positive, warn_of_old_result

from toolkit.progress import Progress


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Gather, render, write."""
    from toolkit.meshio.aside import written_aside
    from toolkit.report import build
    from toolkit.report.from_shot import report_data
    from toolkit.shot import Shot

    shot = Shot(options.shot)
    warn_of_old_result(shot)
    path = Path(options.out or shot.report_path)
    data = report_data(
        shot, forward=options.forward, up=options.up, frames=options.count, folder=path.parent, progress=progress
    )
    with written_aside(path) as temporary:
        temporary.write_text(build(data), encoding="utf-8")
    print(f"report: {path}")
    return {"report": str(path)}


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = parser_for(__doc__)
    add_axes(made)
    made.add_argument("--count", type=positive, default=7, metavar="N", help="frames on the contact sheet (7)")
    made.add_argument("--out", metavar="FILE", help="where to write it (DIR/report.html)")
    return made


if __name__ == "__main__":
    sys.exit(run(parser(), main))
