#!/usr/bin/env python3
"""Make a shot folder from a source reference, a source performance and a target reference.

Nothing is copied but the landmarks and the feature lines: the shot refers to the files where they are.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from _cli import parser_for, run

from toolkit.errors import InputError
from toolkit.meshio.aside import written_aside
from toolkit.progress import Progress


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Write shot.toml and copy the picks."""
    from toolkit.shot import ShotConfig, SourceInput, TargetInput, load_config, save_config

    folder: Path = options.shot
    toml = folder / "shot.toml"
    if toml.exists() and not options.force:
        raise InputError("the shot exists already", where=toml, remedy="edit it, or give --force to write it anew")
    inputs = {"--source-reference": options.source_reference, "--frames": options.frames, "--target": options.target}
    for option, path in inputs.items():
        if not path.exists():
            raise InputError(f"there is no such file for {option}", where=path, remedy="check the path")
    config = ShotConfig(
        SourceInput(options.source_reference.resolve(), options.frames.resolve(), options.fps),
        TargetInput(options.target.resolve()),
    )
    for name, path in {"landmarks.json": options.landmarks, "feature_lines.json": options.feature_lines}.items():
        if path is not None:
            try:
                content = path.read_bytes()
            except OSError as error:
                raise InputError(f"cannot be read ({error.strerror})", where=path, remedy="check the path") from error
            with written_aside(folder / name) as temporary:
                temporary.write_bytes(content)
    folder.mkdir(parents=True, exist_ok=True)
    save_config(toml, config)
    load_config(toml)
    print(f"made {folder}; next: python scripts/run_all.py {folder}")
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
    made.add_argument("--fps", metavar="N", type=float, help="frames a second, if the take does not say it")
    made.add_argument("--force", action="store_true", help="write shot.toml anew if it is there")
    return made


if __name__ == "__main__":
    sys.exit(run(parser(), main))
