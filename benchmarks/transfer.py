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
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from toolkit.feature_lines import load_feature_lines, save_feature_lines, trace_lines  # noqa: E402
from toolkit.mesh import TriangleMesh  # noqa: E402
from toolkit.meshio import read_mesh, write_mesh  # noqa: E402

STAGES = ("decompose", "bases", "transfer", "result")


def main() -> int:
    """Build the shot, run it in a process of its own, print the table."""
    options = _parser().parse_args()
    with tempfile.TemporaryDirectory(prefix="mien_benchmark_", dir=options.work) as folder:
        shot = Path(folder)
        size = build_shot(shot, options)
        if not options.cold:
            _measured(shot)  # compiles, and warms the file cache
        runs = [_measured(shot) for _ in range(options.runs)]
        floor = _read_write_floor(shot / "take.npy", shot / "copy.npy")
    best = sorted(runs, key=lambda run: run["total_s"])[len(runs) // 2]
    print(f"{size['vertices']:,} vertices, {size['frames']} frames, K = {best['bases']}, median of {len(runs)} runs")
    for name, seconds in best["stages"].items():
        print(f"  {name:<10} {seconds:7.2f} s")
    print(f"  {'total':<10} {best['total_s']:7.2f} s   peak memory {best['peak_gb']:.2f} GB, CPU {best['cpu_s']:.1f} s")
    print(f"  reading and writing the same bytes: {floor:.2f} s; total is {best['total_s'] / floor:.1f} times that")
    if options.json:
        print(json.dumps({**best, "floor_s": floor, **size}))
    return 0


def build_shot(folder: Path, options: argparse.Namespace) -> dict[str, int]:
    """Write reference, take, target, feature lines and shot.toml."""
    mesh, lines = _ict(folder, options) if options.ict else _sample(folder, options)
    write_mesh(folder / "source.ply", mesh)
    write_mesh(folder / "target.ply", mesh.with_vertices(mesh.vertices * [1.12, 0.95, 1.05]))
    save_feature_lines(
        folder / "feature_lines.json", trace_lines(load_feature_lines(lines), mesh.vertices, mesh.triangles)
    )
    (folder / "shot.toml").write_text(
        '[source]\nreference = "source.ply"\nframes = "take.npy"\nfps = 30\n[target]\nreference = "target.ply"\n'
        f"[bases]\nthreshold = 1e-6\ncount = {options.bases}\n"
    )
    return {"vertices": mesh.n_vertices, "frames": options.frames}


def _ict(folder: Path, options: argparse.Namespace) -> tuple[TriangleMesh, Path]:
    bake = [sys.executable, str(options.ict / "bake.py"), str(folder / "baked"), "--frames", str(options.frames)]
    subprocess.run(bake, check=True)
    (folder / "baked" / "frames.npy").rename(folder / "take.npy")
    reference = np.load(folder / "baked" / "reference.npy").astype(float)
    triangles = np.load(folder / "baked" / "triangles.npy").astype(np.int32)
    return TriangleMesh(reference, triangles), options.ict / "feature_lines.json"


def _sample(folder: Path, options: argparse.Namespace) -> tuple[TriangleMesh, Path]:
    from data import ensure_samples

    performer = ensure_samples(level=options.level, targets=()).performer
    take = np.load(performer.frames, mmap_mode="r")
    shape = (options.frames, *take.shape[1:])
    frames = np.lib.format.open_memmap(folder / "take.npy", mode="w+", dtype=np.float32, shape=shape)
    for k, place in enumerate(np.linspace(0, len(take) - 1, options.frames)):
        first = min(int(place), len(take) - 2)
        frames[k] = take[first] + np.float32(place - first) * (take[first + 1] - take[first])
    frames.flush()
    return read_mesh(performer.reference), performer.feature_lines


def _measured(shot: Path) -> dict[str, Any]:
    """Stages 2 to 5 in a fresh process, everything run anew; its own account of time and memory."""
    code = f"""
import json, resource, sys, time
sys.path.insert(0, {str(ROOT)!r})
began = time.perf_counter()
from toolkit.shot import Shot
from toolkit.stages import run_stages
shot = Shot({str(shot)!r})
run_stages(shot, ["register"])
start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
reports = run_stages(shot, {list(STAGES)!r}, force=True)
seconds, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_SELF)
cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
stages = {{r.stage: r.seconds for r in reports if r.stage in {list(STAGES)!r}}}
bases = [r.numbers["bases"] for r in reports if r.stage == "bases"][0]
print(json.dumps(dict(total_s=seconds, cpu_s=cpu, peak_gb=after.ru_maxrss / 2**20, stages=stages, bases=bases)))
"""
    out = subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.PIPE, text=True).stdout
    measured: dict[str, Any] = json.loads(out.splitlines()[-1])
    return measured


def _read_write_floor(take: Path, copy: Path) -> float:
    """Seconds to read the take once and write as many bytes."""
    began = time.perf_counter()
    source = np.load(take, mmap_mode="r")
    target = np.lib.format.open_memmap(copy, mode="w+", dtype=source.dtype, shape=source.shape)
    for start in range(0, len(source), 16):
        target[start : start + 16] = source[start : start + 16]
    target.flush()
    return time.perf_counter() - began


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ict", type=Path, metavar="FOLDER", help="folder of the ICT performer; else the own sample")
    parser.add_argument("--level", type=int, default=2, choices=(0, 1, 2), help="resolution of the own sample (2)")
    parser.add_argument("--frames", type=int, default=363, help="number of frames (363)")
    parser.add_argument("--bases", type=int, default=10, help="number of bases K (10)")
    parser.add_argument("--runs", type=int, default=3, help="measured runs, the median is printed (3)")
    parser.add_argument("--cold", action="store_true", help="no warm-up run: the first run compiles")
    parser.add_argument("--work", type=Path, help="where to put the temporary shot")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser


if __name__ == "__main__":
    sys.exit(main())
