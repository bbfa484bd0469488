#!/usr/bin/env python3
"""How long a pose edit takes, beside the one back-substitution that it cannot do without.

The face is a made-up smooth surface with smooth bases and curves, of the size asked for. ``frame_s`` is from a moved
point to the edited frame, rebuilt with its details, as while dragging (warm start, window of ``--window`` frames);
``window_s`` and ``take_s`` are cold solves to convergence, as on release, over the window and over all frames;
``held_s`` is ``take_s`` with everything fixed that is farther than a quarter of the face from the points,
``prepare_s`` the factor with the reach, which a session makes as it opens, ``first_s`` the window's first solve for
these vertices, their back-substitutions included, ``rebuild_s`` the frame alone. The best of the runs counts: what else
the machine does only adds to it.

``--coarse 10000`` also solves the edit among the displacements of a decimated copy (fast-simplification's replayed
collapses), as the paper does while the pointer moves. The exact way needs one factor a session and one substitution for
each new vertex, nothing while a pointer moves; decimating and carrying up cost more. Seconds of the processor to the
first frame, exact / on 10,000 vertices: 0.13 / 0.37 at 20,000, 0.7 / 1.4 at 105,550, 3.7 / 5.5 at 400,000, and the
coarse answer is off by 5 to 16 % of the motion. So edits are exact from the first.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._edits.coarse import compare_with_coarse  # noqa: E402
from benchmarks._edits.faces import bells, made_up_face, unplaced  # noqa: E402
from benchmarks._edits.timing import parser_for, timed  # noqa: E402
from toolkit.decomposition import Decomposer  # noqa: E402
from toolkit.mesh import TriangleMesh  # noqa: E402
from toolkit.pose_edit import (  # noqa: E402
    BeyondConstraint,
    EditableTake,
    EditParameters,
    PointConstraint,
    PoseEdit,
    PoseEditor,
)
from toolkit.transfer import DeformationTransfer, TransferParameters  # noqa: E402

_LAST = ("frame_s", "window_s", "take_s", "back_substitution_s")
_NAMES = ("factorise_s", "prepare_s", "first_s", "rebuild_s", "held_s", *_LAST)


def main() -> int:
    """Make the face, solve the edits, print the times."""
    options = _parser().parse_args()
    take, triangles = made_up_take(options.vertices, options.bases, options.frames)
    key = options.frames // 2
    points = spread_points(take, options.points, key)
    window = (max(key - options.window // 2, 0), min(key - options.window // 2 + options.window, options.frames) - 1)
    numbers: dict[str, Any] = {"vertices": take.n_vertices, "bases": take.n_bases, "frames": take.n_frames}
    numbers |= {"points": len(points), "window": window[1] - window[0] + 1}
    numbers |= measured(take, triangles, points, key, window, options.runs)
    print(f"{take.n_vertices:,} vertices, K = {take.n_bases}, {take.n_frames} frames, {len(points)} points")
    for name in _NAMES:
        cpu, floors = numbers[f"cpu_{name}"], numbers[name] / numbers["back_substitution_s"]
        print(f"  {name:<20} {numbers[name]:8.3f} s   {cpu:8.3f} s of the processor   {floors:6.1f} x floor")
    print(f"  rounds: window {numbers['window_rounds']}, take {numbers['take_rounds']}")
    if options.coarse is not None:
        numbers |= _compared(take, triangles, points, window, options.coarse)
    if options.json:
        print(json.dumps({name: numbers[name] for name in (*(n for n in numbers if n not in _LAST), *_LAST)}))
    return 0


def _compared(
    take: EditableTake, triangles: np.ndarray, points: list[PointConstraint], window: tuple[int, int], coarse: int
) -> dict[str, float]:
    found = compare_with_coarse(take, triangles, points, window, coarse)
    exact = found["exact_factor_s"] + found["exact_first_s"]
    rough = found["coarse_decimate_s"] + found["coarse_factor_s"] + found["coarse_first_s"]
    print("to the first frame, seconds of the processor:")
    print(f"  exact {exact:.2f}: factor {found['exact_factor_s']:.2f}, solve {found['exact_first_s']:.2f}")
    print(
        f"  on {coarse:,} vertices {rough:.2f}: decimate {found['coarse_decimate_s']:.2f}, factor "
        f"{found['coarse_factor_s']:.2f}, solve and carry up {found['coarse_first_s']:.2f}; differs by "
        f"{found['coarse_differs']:.1%} of the largest motion at most, {found['coarse_differs_rms']:.2%} on the whole"
    )
    return found


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
    near, everywhere = EditParameters(window=window), EditParameters()
    far = BeyondConstraint(0.25 * float(np.linalg.norm(np.ptp(take.rest, axis=0))))
    build = frame_builder(take, triangles, key)
    edits: dict[str, PoseEdit] = {}
    numbers: dict[str, Any] = {}

    def note(name: str, work: Callable[[int], object], runs: int = runs) -> None:
        times = timed(work, runs)
        numbers[name], numbers[f"cpu_{name}"] = times.best, times.best_cpu

    def moved(run: int) -> list[PointConstraint]:
        x, y, z = points[0].offset or (0.0, 0.0, 0.0)
        return [replace(points[0], offset=(x, y + 0.01 * (run + 1), z)), *points[1:]]

    def drag(run: int) -> None:
        build(editor.solve(moved(run), near, warm=True))

    def release(name: str, parameters: EditParameters) -> Callable[[int], None]:
        def solve(run: int) -> None:
            edits[name] = editor.solve(moved(run), parameters)

        return solve

    note("factorise_s", lambda _: take.system.factor, 1)
    note("back_substitution_s", lambda _: take.system.factor.solve(right))
    editor = PoseEditor(take, triangles)
    note("prepare_s", lambda _: editor.prepare(near), 1)
    note("first_s", lambda _: editor.solve(points, near), 1)
    edited = editor.solve(points, near)
    drag(0)
    note("rebuild_s", lambda _: build(edited))
    note("frame_s", drag)
    note("window_s", release("window", near))
    note("take_s", release("take", everywhere))
    editor.solve([*points[:3], far], everywhere)
    note("held_s", lambda run: editor.solve([*moved(run)[:3], far], everywhere))
    return numbers | {f"{name}_rounds": edit.rounds for name, edit in edits.items()}


def frame_builder(take: EditableTake, triangles: np.ndarray, key: int) -> Callable[[PoseEdit], None]:
    """What builds the key frame of an edit as a session does: bases, local frames, details, the head's motion."""
    target = Decomposer(TriangleMesh(take.rest, triangles))
    rebuilt = unplaced(target, take.moves + take.rest, take.weights)
    details = np.random.default_rng(3).normal(0, 0.01, (1, take.n_vertices, 3)).astype(np.float32)
    out = np.empty_like(details)

    def build(edit: PoseEdit) -> None:
        rebuilt.edited(edit.weights, edit.take.edits).frames(key, key + 1, details, out)

    return build


def made_up_take(n_vertices: int, n_bases: int, n_frames: int) -> tuple[EditableTake, np.ndarray]:
    """A domed surface, bases that are bells at random places, curves that come and go."""
    rng = np.random.default_rng(1)
    mesh = made_up_face(n_vertices)
    moves = bells(mesh.vertices, n_bases, rng)
    t = np.arange(n_frames)[:, None]
    speed, phase = rng.uniform(0.01, 0.06, n_bases), rng.uniform(0, 2 * np.pi, n_bases)
    weights = np.clip(np.sin(speed * t + phase), 0, None) ** 2
    plain = TransferParameters(feature_lines=False, contacts=False, robust=False)
    system = DeformationTransfer(mesh.vertices, mesh.vertices, mesh.triangles, moves, parameters=plain)
    return EditableTake(mesh.vertices, moves, weights, system), mesh.triangles


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


def _parser() -> argparse.ArgumentParser:
    parser = parser_for(__doc__)
    parser.add_argument("--coarse", type=int, metavar="N", help="also solve on a copy decimated to N vertices")
    parser.add_argument("--points", type=int, default=12, help="point constraints (default %(default)s)")
    return parser


if __name__ == "__main__":
    sys.exit(main())
