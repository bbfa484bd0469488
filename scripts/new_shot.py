#!/usr/bin/env python3
"""Make a shot folder from a source reference, a source performance and a target reference.

Nothing is copied but the landmarks and the feature lines: the shot refers to the files where they are.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from shlex import quote
from typing import Any

from _cli import chosen, parser_for, run
from _views import positive_number

from toolkit.progress import Progress


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Write shot.toml and copy the picks."""
    from toolkit.shot.new import create_shot

    folder: Path = options.shot
    named = ("landmarks", "feature_lines", "source_extras", "target_extras", "fps", "force")
    create_shot(folder, options.source_reference, options.frames, options.target, **chosen(options, *named))
    print(f"made {folder}; next: python scripts/run_all.py {quote(str(folder))}")
    return {"shot": str(folder)}


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = parser_for(__doc__)
    made.add_argument("--source-reference", metavar="F", type=Path, required=True, help="the performer's neutral mesh")
    made.add_argument(
        "--frames",
        metavar="F",
        type=Path,
        required=True,
        help="the take: a folder of OBJ or PLY, or .npy, .npz, .pc2, .mdd, .abc, .usd, .glb",
    )
    made.add_argument("--target", metavar="F", type=Path, required=True, help="the target's neutral mesh, any topology")
    made.add_argument("--landmarks", metavar="F", type=Path, help="landmarks.json with vertex ids on both meshes")
    made.add_argument("--feature-lines", metavar="F", type=Path, help="feature_lines.json with vertex ids")
    for side in ("source", "target"):
        what = f"meshes for the {side}'s pictures only, e.g. eyeballs; they ride with the head"
        made.add_argument(f"--{side}-extras", metavar="F", type=Path, nargs="+", default=[], help=what)
    made.add_argument("--fps", metavar="N", type=positive_number, help="frames a second, if the take does not say it")
    made.add_argument("--force", action="store_true", help="write shot.toml anew if it is there")
    return made


if __name__ == "__main__":
    sys.exit(run(parser(), main))
