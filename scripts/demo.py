#!/usr/bin/env python3
"""The demonstration: the sample performance on a human and on a hound, with pictures, video, glTF and reports.

It runs the same commands that a user would, and prints each before it runs it.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from _cli import ROOT, parser_for, run

from toolkit.progress import Progress

TARGETS = ("asian_female", "hound")


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Get the samples, make two shots, run them, render and export."""
    from data import ensure_samples

    began = time.perf_counter()
    out: Path = options.out
    print("Getting the sample faces (built once, kept in data/cache)", flush=True)
    samples = ensure_samples(targets=TARGETS, level=options.level, progress=progress)
    ready = time.perf_counter()
    shots = [out / name for name in TARGETS]
    for name, shot in zip(TARGETS, shots, strict=True):
        target, performer = samples.targets[name], samples.performer
        inputs = ["--source-reference", performer.reference, "--frames", performer.frames, "--fps", performer.fps]
        inputs += ["--target", target.reference, "--landmarks", target.landmarks_head]
        inputs += ["--source-extras", performer.eyes, "--target-extras", target.eyes]
        _command("new_shot.py", shot, "--force", *inputs, "--feature-lines", target.feature_lines)
        _command("run_all.py", shot)
        _command("7_export.py", shot, "--format", "gltf", "--out", out / f"{name}.glb")
        _command("report.py", shot, "--out", out / f"report_{name}.html")
    _command("render.py", *shots, "--out", out, "--video", "--height", 440)
    shutil.copyfile(out / "performance.mp4", out / "side_by_side.mp4")
    (out / "performance.mp4").unlink()
    seconds = time.perf_counter() - began
    print(f"\nDone in {seconds:.0f} s, {ready - began:.0f} s of it for the samples. Look at:")
    for file in sorted(out.iterdir()):
        if file.is_file():
            print(f"  {_short(file)}")
    return {"seconds": seconds, "samples_s": ready - began, "out": str(out)}


def _command(script: str, *arguments: Any) -> None:
    words = [str(argument) for argument in arguments]
    print(f"\n$ python scripts/{script} {' '.join(_short(word) for word in words)}", flush=True)
    subprocess.run([sys.executable, str(ROOT / "scripts" / script), *words], check=True)


def _short(path: str | Path) -> str:
    """A path as seen from the repository, so that the lines stay readable."""
    try:
        return str(Path(path).relative_to(ROOT))
    except ValueError:
        return str(path)


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = parser_for(__doc__, shot=False)
    made.add_argument("--out", type=Path, default=ROOT / "demo", help="where everything goes (demo/)")
    made.add_argument(
        "--level", type=int, default=2, choices=(0, 1, 2), help="resolution of the samples (2: 69K vertices)"
    )
    return made


if __name__ == "__main__":
    sys.exit(run(parser(), main))
