#!/usr/bin/env python3
"""How long a detail edit takes, beside one back-substitution for every frame of its window.

The face is a made-up smooth surface of the size asked for, with bases that are bells and a field of wrinkles that comes
and goes round the middle of the take. ``frame_s`` is from a changed factor to the edited frame, rebuilt, as while
dragging a slider; ``window_s`` is the paper's least squares in space and time (Eqs. 18-21), from the edit to the change
of every frame of its window, read from disk; ``follow_s`` is the default way of going on in time, ``paste_s`` and
``reshape_s`` a wrinkle pasted and bent (first time; ``_again_s`` turned once more, as while dragging). ``brush_s`` is
one touch of a brush as large as the region. ``back_substitution_s`` is a floor: one factor of the region's system, as
many right-hand sides as the window has frames and axes.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._edits.faces import bells, made_up_face, unplaced  # noqa: E402
from benchmarks._edits.timing import parser_for, timed  # noqa: E402
from toolkit.decomposition import Decomposer  # noqa: E402
from toolkit.detail_edit import (  # noqa: E402
    Dab,
    DetailTake,
    PasteEdit,
    Region,
    ReshapeEdit,
    ScaleEdit,
    drawn,
    painted,
    snapped,
    solve_detail_edit,
)
from toolkit.detail_edit.propagation import region_laplacian  # noqa: E402
from toolkit.details import Reconstruction  # noqa: E402
from toolkit.mesh.geometry import local_frames  # noqa: E402
from toolkit.solve import factorise  # noqa: E402

_NAMES = (
    "brush_s",
    "frame_s",
    "rebuild_s",
    "follow_s",
    "window_s",
    "paste_s",
    "paste_again_s",
    "reshape_s",
    "back_substitution_s",
)


def main() -> int:
    """Make the face and the take, solve the edits, print the times."""
    options = _parser().parse_args()
    with tempfile.TemporaryDirectory() as folder:
        take, rebuild, weights = made_up_take(options, Path(folder))
        region = nearest(take, options.region)
        numbers: dict[str, Any] = {"vertices": take.n_vertices, "frames": take.n_frames}
        numbers |= {"region": len(region), "window": options.window}
        numbers |= measured(take, rebuild, weights, region, options)
    print(f"{take.n_vertices:,} vertices, {take.n_frames} frames, {len(region):,} in the region")
    for name in _NAMES:
        print(f"  {name:<20} {numbers[name]:8.3f} s   {numbers['cpu_' + name]:8.3f} s of the processor")
    shares = numbers["gradients_share_at_key"], numbers["gradients_share_beside"]
    print("  the paper's least squares keeps {:.0%} of the change at the key frame, {:.0%} beside it".format(*shares))
    if options.json:
        last = ("frame_s", "window_s", "back_substitution_s")
        print(json.dumps({name: numbers[name] for name in (*(n for n in numbers if n not in last), *last)}))
    return 0


def measured(
    take: DetailTake, rebuild: Reconstruction, weights: np.ndarray, region: Region, options: argparse.Namespace
) -> dict[str, Any]:
    """Medians over the runs; every run asks for something a little different."""
    key, runs = take.n_frames // 2, options.runs
    window = (max(key - options.window // 2, 0), min(key - options.window // 2 + options.window, take.n_frames) - 1)
    scale = ScaleEdit(region=region, frame=key, factor=2.0, window=window, band=0.0)
    middle = snapped(take.surface, take.smooth[region.vertices].mean(axis=0)[None])[0]
    reach = float(np.ptp(take.smooth[region.vertices, 0])) / 2
    aside = snapped(take.surface, take.surface.place(middle)[None] + [1.5 * reach, 1.2 * reach, 0])[0]
    paste = PasteEdit(region=region, frame=key, start=middle, goal=aside, window=window)
    ends = [snapped(take.surface, take.surface.place(middle)[None] + [s * 0.6 * reach, 0, 0])[0] for s in (-1, 1)]
    bend = snapped(take.surface, take.surface.place(middle)[None] + [0, 0.3 * reach, 0])[0]
    curve = drawn(take.surface, ends)
    reshape = ReshapeEdit(
        region=region, frame=key, curve=curve, goal=drawn(take.surface, [ends[0], bend, ends[1]]), window=window
    )
    details = np.ascontiguousarray(take.details[key : key + 1])
    frame = np.empty((1, take.n_vertices, 3), dtype=np.float32)

    def drag(run: int) -> None:
        change = solve_detail_edit(replace(scale, factor=2.0 + 0.1 * run), take)
        rebuild.edited(weights, details=[change]).frames(key, key + 1, details, frame)

    radius = float(take.surface.distance([middle])[region.vertices].max())
    gradients = replace(scale, propagation="gradients")
    shares = _shares(gradients, take)  # and compiles
    drag(0)
    laplacian = region_laplacian(take.surface.triangles[take.surface.triangles_at(region.vertices)], region.vertices)
    factor = factorise(sp.csc_matrix(0.01 * sp.identity(len(region)) + 0.1 * laplacian))
    right = np.random.default_rng(3).standard_normal((len(region), 3 * options.window))
    work: dict[str, Callable[[int], object]] = {
        "brush_s": lambda run: painted(take.surface, [Dab(middle, radius * (1 + 0.01 * run))]),
        "frame_s": drag,
        "rebuild_s": lambda _: rebuild.frames(key, key + 1, details, frame),
        "follow_s": lambda run: solve_detail_edit(replace(scale, factor=2.0 + 0.1 * run), take),
        "window_s": lambda run: solve_detail_edit(replace(gradients, factor=2.0 + 0.1 * run), take),
        "paste_s": lambda _: solve_detail_edit(paste, replace(take, shared=type(take.shared)())),
        "paste_again_s": lambda run: solve_detail_edit(replace(paste, rotation=10.0 * run), take),
        "reshape_s": lambda _: solve_detail_edit(reshape, take),
        "back_substitution_s": lambda _: factor.solve(right),
    }
    numbers: dict[str, Any] = dict(shares)
    for name, one in work.items():
        times = timed(one, runs)
        numbers[name], numbers[f"cpu_{name}"] = times.median, times.median_cpu
    return numbers


def made_up_take(options: argparse.Namespace, folder: Path) -> tuple[DetailTake, Reconstruction, np.ndarray]:
    """A domed surface with moving bells; wrinkles on disk, in as many frames as the window and its neighbours have."""
    mesh = made_up_face(options.vertices)
    rest, triangles = mesh.vertices, mesh.triangles
    target = Decomposer(mesh)
    key, reach = options.frames // 2, options.window
    details = np.lib.format.open_memmap(
        folder / "details.npy", mode="w+", dtype=np.float32, shape=(options.frames, len(rest), 3)
    )
    pattern = 0.02 * np.cos(2 * np.pi * rest[:, 1] / 0.6) * np.exp(-(rest[:, 0] ** 2 + rest[:, 1] ** 2) / 20)
    for t in range(max(key - reach, 0), min(key + reach, options.frames)):
        details[t, :, 2] = np.exp(-(((t - key) / (0.4 * options.window)) ** 2)) * pattern
        details[t, :, 1] = 0.2 * details[t, :, 2]
    details.flush()
    rng = np.random.default_rng(1)
    bases = target.rest.smooth + bells(rest, options.bases, rng)
    weights = np.abs(rng.normal(0, 0.3, (options.frames, options.bases)))
    rebuild = unplaced(target, bases, weights)
    smooth, neighbour = target.rest.smooth, target.rest.neighbour
    frames0 = local_frames(smooth, triangles, neighbour)
    held = np.load(folder / "details.npy", mmap_mode="r")
    take = DetailTake(mesh, smooth, neighbour, frames0, held, np.ones(len(rest)), target.rest.detail)
    return take, rebuild, weights


def nearest(take: DetailTake, count: int) -> Region:
    """The ``count`` vertices nearest to the middle of the face, along the surface."""
    middle = int(np.argmin(np.sum(take.smooth[:, :2] ** 2, axis=1)))
    distance = take.surface.distance([take.surface.at_vertex(middle)])
    return Region.whole(np.argsort(distance, kind="stable")[:count])


def _shares(edit: ScaleEdit, take: DetailTake) -> dict[str, float]:
    """What of the change asked for the paper's least squares lets through, at the key frame and in the next one.

    The wrinkles here are ten edges wide; the default way lets all of it through at the key frame.
    """
    change = solve_detail_edit(edit, take)
    asked = np.linalg.norm((edit.factor - 1) * take.unedited(edit.frame, edit.frame, change.vertices))
    assert change.offset is not None
    key = edit.frame - change.window[0]
    found = [float(np.linalg.norm(change.offset[k]) / asked) for k in (key, key + 1)]
    return {"gradients_share_at_key": found[0], "gradients_share_beside": found[1]}


def _parser() -> argparse.ArgumentParser:
    parser = parser_for(__doc__)
    parser.add_argument("--region", type=int, default=5000, help="vertices of the region (default %(default)s)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
