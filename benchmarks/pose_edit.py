#!/usr/bin/env python3
"""How long a pose edit takes, beside the one back-substitution that it cannot do without.

The face is a made-up smooth surface with smooth bases and curves, of the size asked for. ``frame_s`` is from a moved
point to the edited frame, rebuilt with its details, as while dragging (warm start, window of ``--window`` frames);
``window_s`` and ``take_s`` are cold solves to convergence, as on release, over the window and over all frames;
``held_s`` is ``take_s`` with everything fixed that is farther than a quarter of the face from the points, ``first_s``
the window's first solve for these vertices, their back-substitutions and the reach's factor included, ``rebuild_s``
the frame alone. The best of the runs counts: what else the machine does only adds to it.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from toolkit.decomposition import Decomposer  # noqa: E402
from toolkit.details import Reconstruction  # noqa: E402
from toolkit.mesh import TriangleMesh  # noqa: E402
from toolkit.pose_edit import (  # noqa: E402
    BeyondConstraint,
    EditableTake,
    EditParameters,
    PointConstraint,
    PoseEdit,
    PoseEditor,
)
from toolkit.rigid import Similarity  # noqa: E402
from toolkit.stabilisation import HeadMotion  # noqa: E402
from toolkit.transfer import DeformationTransfer, TransferParameters  # noqa: E402


def main() -> int:
    """Make the face, solve the edits, print the times."""
    options = _parser().parse_args()
    take, triangles, factorise_s = made_up_take(options.vertices, options.bases, options.frames)
    key = options.frames // 2
    points = spread_points(take, options.points, key)
    window = (max(key - options.window // 2, 0), min(key - options.window // 2 + options.window, options.frames) - 1)
    numbers: dict[str, Any] = {"vertices": take.n_vertices, "bases": take.n_bases, "frames": take.n_frames}
    numbers |= {"points": len(points), "window": window[1] - window[0] + 1, "factorise_s": factorise_s}
    numbers |= measured(take, triangles, points, key, window, options.runs)
    print(f"{take.n_vertices:,} vertices, K = {take.n_bases}, {take.n_frames} frames, {len(points)} points")
    names = ("factorise_s", "back_substitution_s", "first_s", "rebuild_s", "frame_s", "window_s", "take_s", "held_s")
    for name in names:
        print(f"  {name:<20} {numbers[name]:8.3f} s   {numbers[name] / numbers['back_substitution_s']:6.1f} x floor")
    print(f"  rounds: window {numbers['window_rounds']}, take {numbers['take_rounds']}")
    if options.json:
        print(json.dumps(numbers))
    return 0


def measured(
    take: EditableTake,
    triangles: np.ndarray,
    points: list[PointConstraint],
    key: int,
    window: tuple[int, int],
    runs: int,
) -> dict[str, Any]:
    """The best of the runs; every run moves one point to a new place."""
    right = np.zeros((take.n_vertices, len(points)))
    right[[point.vertex for point in points], np.arange(len(points))] = 1
    floor = _best(lambda _: take.system.factor.solve(right), runs)
    near, everywhere = EditParameters(window=window), EditParameters()
    editor = PoseEditor(take, triangles)
    first = _best(lambda _: editor.solve(points, near), 1)
    build = frame_builder(take, triangles, key)
    edits: dict[str, PoseEdit] = {}

    def moved(run: int) -> list[PointConstraint]:
        x, y, z = points[0].offset or (0.0, 0.0, 0.0)
        return [replace(points[0], offset=(x, y + 0.01 * (run + 1), z)), *points[1:]]

    def drag(run: int) -> None:
        build(editor.solve(moved(run), near, warm=True))

    def release(name: str, parameters: EditParameters) -> Callable[[int], None]:
        def solve(run: int) -> None:
            edits[name] = editor.solve(moved(run), parameters)

        return solve

    drag(0)
    frame = _best(drag, runs)
    edited = editor.solve(points, near)
    rebuild = _best(lambda _: build(edited), runs)
    window_s = _best(release("window", near), runs)
    take_s = _best(release("take", everywhere), runs)
    far = BeyondConstraint(0.25 * float(np.linalg.norm(np.ptp(take.rest, axis=0))))
    editor.solve([*points[:3], far], everywhere)
    held_s = _best(lambda run: editor.solve([*moved(run)[:3], far], everywhere), runs)
    rounds = {f"{name}_rounds": edit.rounds for name, edit in edits.items()}
    times = {"first_s": first, "rebuild_s": rebuild, "frame_s": frame, "window_s": window_s, "take_s": take_s}
    times["held_s"] = held_s
    return rounds | times | {"back_substitution_s": floor}


def frame_builder(take: EditableTake, triangles: np.ndarray, key: int) -> Callable[[PoseEdit], None]:
    """What builds the key frame of an edit as a session does: bases, local frames, details, the head's motion."""
    target = Decomposer(TriangleMesh(take.rest, triangles))
    gain = np.ones(take.n_vertices)
    motion, still = HeadMotion.none(take.n_frames), Similarity(1.0, np.eye(3), np.zeros(3))
    rebuilt = Reconstruction(target, take.moves + take.rest, take.weights, gain, motion, still)
    details = np.random.default_rng(3).normal(0, 0.01, (1, take.n_vertices, 3)).astype(np.float32)
    out = np.empty_like(details)

    def build(edit: PoseEdit) -> None:
        rebuilt.edited(edit.weights, edit.take.edits).frames(key, key + 1, details, out)

    return build


def made_up_take(n_vertices: int, n_bases: int, n_frames: int) -> tuple[EditableTake, np.ndarray, float]:
    """A domed surface, bases that are bells at random places, curves that come and go; and the time to factorise."""
    rng = np.random.default_rng(1)
    n = max(round(np.sqrt(n_vertices)), 8)
    m = max(round(n_vertices / n), 8)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(m - 1), indexing="ij")
    a = (i * m + j).ravel()
    b, c, d = a + m, a + m + 1, a + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(-8, 8, n), np.linspace(-10, 10, m), indexing="ij"))
    rest = np.column_stack([u, v, 8 * np.exp(-((u / 9) ** 2) - (v / 11) ** 2) + 0.1 * np.sin(2 * u) * np.cos(v)])
    moves = np.empty((n_bases, len(rest), 3))
    for k in range(n_bases):
        x, y, size = rng.uniform(-5, 5), rng.uniform(-7, 7), rng.uniform(1.5, 4)
        bell = np.exp(-((u - x) ** 2 + (v - y) ** 2) / size**2)
        moves[k] = bell[:, None] * rng.normal(0, 0.6, 3)
    t = np.arange(n_frames)[:, None]
    speed, phase = rng.uniform(0.01, 0.06, n_bases), rng.uniform(0, 2 * np.pi, n_bases)
    weights = np.clip(np.sin(speed * t + phase), 0, None) ** 2
    motion = np.sqrt((moves**2).sum(axis=2)).max(axis=0)
    began = time.perf_counter()
    system = DeformationTransfer(
        rest, rest, triangles, motion, parameters=TransferParameters(feature_lines=False, contacts=False)
    )
    return EditableTake(rest, moves, weights, system), triangles, time.perf_counter() - began


def spread_points(take: EditableTake, count: int, key: int) -> list[PointConstraint]:
    """Points all over the face, at the key frame and at frames around it, each pulled its own way."""
    rng = np.random.default_rng(2)
    vertices = rng.choice(np.flatnonzero(np.abs(take.rest[:, :2]).max(axis=1) < 6), count, replace=False)
    frames = np.clip(key + rng.integers(-20, 21, count), 0, take.n_frames - 1)
    frames[: (count + 1) // 2] = key
    offsets = rng.normal(0, 0.2, (count, 3))
    return [
        PointConstraint(int(frame), int(vertex), offset=(float(x), float(y), float(z)))
        for frame, vertex, (x, y, z) in zip(frames, vertices, offsets, strict=True)
    ]


def _best(work: Callable[[int], object], runs: int) -> float:
    seconds = []
    for run in range(runs):
        began = time.perf_counter()
        work(run)
        seconds.append(time.perf_counter() - began)
    return min(seconds)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, default=105_550, help="vertices of the face (default %(default)s)")
    parser.add_argument("--bases", type=int, default=28, help="bases K (default %(default)s)")
    parser.add_argument("--frames", type=int, default=1300, help="frames of the take (default %(default)s)")
    parser.add_argument("--window", type=int, default=100, help="frames of the window (default %(default)s)")
    parser.add_argument("--points", type=int, default=12, help="point constraints (default %(default)s)")
    parser.add_argument("--runs", type=int, default=5, help="runs to take the best of (default %(default)s)")
    parser.add_argument("--json", action="store_true", help="end with one machine-readable line")
    return parser


if __name__ == "__main__":
    sys.exit(main())
