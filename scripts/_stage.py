"""The step scripts 1 to 5: run one stage, and what it needs, and say its numbers."""

from __future__ import annotations

import argparse
from typing import Any

from _cli import parser_for, print_stages, run

from toolkit.progress import Progress


def stage_script(description: str | None, stage: str) -> int:
    """Run one stage of a shot as a script."""
    parser = parser_for(description)
    parser.add_argument("--force", action="store_true", help="run it even if it is up to date")

    def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
        from toolkit.shot import Shot
        from toolkit.stages import run_stages

        reports = run_stages(Shot(options.shot), [stage], force=options.force, progress=progress)
        print_stages(reports)
        for name, value in reports[-1].numbers.items():
            print(f"  {name}: {value:.6g}" if isinstance(value, float) else f"  {name}: {value}")
        return {"stage": stage, "skipped": reports[-1].skipped, "numbers": reports[-1].numbers}

    return run(parser, main)
