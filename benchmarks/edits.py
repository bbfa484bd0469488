#!/usr/bin/env python3
"""Edits beside the paper's section 6 and Table 2: refine the edited frame, and carry the edit over the take.

On the sample performer (80K vertices, 1,300 frames, 28 bases by default) through the same calls as the viewer's.
Section 6: "refine" is from a moved point, or a changed wrinkle, to the edited frame, rebuilt; "window" and "take" solve
the edit for its frames, as on release; any frame is then built on demand; "5.2" is the paper's own propagation of
details instead of ours, which follows the wrinkle. "write" is every frame of the edited take
written to the disk, for which the paper gives no time.

Table 2: as many frames edited as the paper's users edited, one after the other, each solved over a window as on
release and shown; the paper's times are those of the refinements. --table2 runs its rows, each at its own size.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._scale.runs import write_shot  # noqa: E402
from toolkit.detail_edit import Region, ScaleEdit  # noqa: E402
from toolkit.editing import EditSession  # noqa: E402
from toolkit.pose_edit import EditParameters, PointConstraint  # noqa: E402
from toolkit.shot import Shot  # noqa: E402
from toolkit.stages import run_stages  # noqa: E402

# The paper's section 6, seconds: 0.5 to refine, 1 to 7 over a window, 4.5 and 6.8 over a take of 1,300 frames.
_PAPER = {
    "pose: refine": 0.5,
    "pose: window": 1.0,
    "pose: take": 4.5,
    "detail: refine": 0.5,
    "detail: window": 1.0,
    "detail: take": 6.8,
    "detail: window, 5.2": 1.0,
    "detail: take, 5.2": 6.8,
}
_GOALS = {
    "pose: refine": 0.03,
    "pose: window": 0.3,
    "pose: take": 1.0,
    "detail: window": 0.25,
    "detail: window, 5.2": 0.25,
}


@dataclass(frozen=True)
class EditedRow:
    """A row of the paper's Table 2; ``frames`` and ``bases`` of the take are those of its Table 1."""

    name: str
    kind: str
    vertices: int
    frames: int
    bases: int
    edited: int
    seconds: float


TABLE_2 = (
    EditedRow("Abu to Dog1", "pose", 80_000, 1373, 28, 23, 91),
    EditedRow("Max to Rejane", "pose", 30_000, 200, 5, 1, 2),
    EditedRow("Abu to Dog2", "detail", 80_000, 308, 10, 1, 4),
    EditedRow("Abu to Baby", "detail", 80_000, 1373, 30, 24, 99),
    EditedRow("Man to Woman", "detail", 1_180_000, 348, 10, 1, 5),
)


class Face:
    """A session with places to edit: points all over the moving face, and a wrinkled region."""

    def __init__(self, session: EditSession, points: int, region: int, window: int) -> None:
        self.session, self._points, self._width = session, points, window
        moving = session.unedited_state
        key = session.n_frames // 2
        moved = np.linalg.norm(moving.frame(key) - session.rest, axis=1)
        rng = np.random.default_rng(2)
        # On the face, where a take moves: the half of the vertices that are farthest in front.
        front = np.flatnonzero(session.rest[:, 2] > np.median(session.rest[:, 2]))
        self._vertices = rng.choice(front, points, replace=False)
        centre = session.rest[front[np.argmax(moved[front])]]
        self._region = Region.whole(np.argsort(np.linalg.norm(session.rest - centre, axis=1))[:region])
        self._size = float(np.ptp(session.rest, axis=0).max())

    def window(self, key: int) -> tuple[int, int]:
        """First and last frame of the window round a key frame."""
        first = max(0, min(key - self._width // 2, self.session.n_frames - self._width))
        return first, min(first + self._width, self.session.n_frames) - 1

    def pose(self, key: int, step: int, window: tuple[int, int] | None, *, warm: bool) -> int:
        """Pull the points at the key frame, one of them a little farther at each ``step``; returns the frame."""
        rng = np.random.default_rng(3)
        offsets = 0.003 * self._size * rng.normal(size=(self._points, 3))
        offsets[0, 1] += 3e-4 * self._size * (step + 1)
        pulls = [
            PointConstraint(key, int(vertex), offset=(float(x), float(y), float(z)))
            for vertex, (x, y, z) in zip(self._vertices, offsets, strict=True)
        ]
        self.session.draft_pose(pulls, replace(EditParameters(), window=window), warm=warm)
        self.session.frame(key)
        return key

    def detail(self, key: int, step: int, window: tuple[int, int], propagation: str = "follow") -> int:
        """Weaken the region's wrinkles at the key frame, by another factor at each ``step``; returns the frame."""
        factor = 0.1 + 0.01 * step
        edit = ScaleEdit(region=self._region, frame=key, factor=factor, window=window, propagation=propagation)
        self.session.draft_detail(edit)
        self.session.frame(key)
        return key


def main() -> int:
    """Measure section 6, and Table 2 if it is asked for."""
    options = _parser().parse_args()
    said: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="mien_edits_", dir=options.work) as folder:
        work = Path(folder)
        if not options.no_section6:
            said["section6"] = _section_6(
                _opened(work / "shot", options.vertices, options.frames, options.bases, options.takes), options
            )
        if options.table2:
            said["table2"] = _table_2(work, options)
    if options.json:
        print(json.dumps(said))
    return 0


def _section_6(session: EditSession, options: argparse.Namespace) -> dict[str, Any]:
    region = min(options.region, session.n_vertices)
    face = Face(session, options.points, region, options.window)
    key, whole = session.n_frames // 2, (0, session.n_frames - 1)
    near = face.window(key)
    print(
        f"{session.n_vertices:,} vertices, {session.n_frames} frames, K = {session.n_bases}; {options.points} points, "
        f"a region of {region:,} vertices, windows of {near[1] - near[0] + 1} frames; medians of {options.runs}"
    )
    print(f"{'':<20}{'paper s':>9}{'ours s':>9}{'faster':>8}{'goal s':>8}", flush=True)
    rows: dict[str, float] = {}

    def row(name: str, work: Callable[[int], object], runs: int) -> None:
        rows[name] = _median(work, runs)
        paper, goal = _PAPER.get(name), _GOALS.get(name)
        faster = f"{paper / rows[name]:>8.1f}" if paper else f"{'':>8}"
        judged = "" if goal is None else f"{goal:>8.2f}  {'PASS' if rows[name] <= goal else 'FAIL'}"
        print(f"{name:<20}{paper or '':>9}{rows[name]:>9.3f}{faster}{judged}", flush=True)

    session.frame(key)  # compiled, and read
    row("frame unedited", lambda _: session.frame(key), options.runs)
    row("pose: first", lambda _: face.pose(key, 0, near, warm=False), 1)
    row("pose: refine", lambda run: face.pose(key, run + 1, near, warm=True), options.runs)
    row("pose: window", lambda run: face.pose(key, run, near, warm=False), options.runs)
    row("pose: take", lambda run: face.pose(key, run, None, warm=False), options.runs)
    session.drop_draft()
    row("detail: first", lambda _: face.detail(key, 0, near), 1)
    row("detail: refine", lambda run: face.detail(key, run + 1, (key, key)), options.runs)
    row("detail: window", lambda run: face.detail(key, run + 1, near), options.runs)
    row("detail: take", lambda run: face.detail(key, run + 1, whole), options.runs)
    # The paper's own way of carrying it on (Eqs. 18 and 19), which is not the default.
    row("detail: window, 5.2", lambda run: face.detail(key, run + 1, near, "gradients"), options.runs)
    row("detail: take, 5.2", lambda run: face.detail(key, run + 1, whole, "gradients"), options.runs)
    face.detail(key, 0, near)
    session.commit()
    row("write", lambda _: session.write_result(), 1)
    return rows


def _table_2(work: Path, options: argparse.Namespace) -> list[dict[str, Any]]:
    sizes = f"{'vertices':>10}{'frames':>8}{'edited':>8}"
    print(f"\n{'Table 2':<16}{'kind':<8}{sizes}{'paper s':>9}{'ours s':>9}{'faster':>8}")
    said = []
    for number in options.table2:
        row = TABLE_2[number - 1]
        vertices = max(round(row.vertices * options.share), 4_326)
        frames = max(round(row.frames * options.share), row.bases + 2)
        session = _opened(work / f"row{number}", vertices, frames, row.bases, options.takes)
        face = Face(session, options.points, min(options.region, vertices), min(options.window, frames))
        session.frame(0)
        began = time.perf_counter()
        for key in np.linspace(0, frames - 1, row.edited + 2).astype(int)[1:-1]:
            window = face.window(int(key))
            if row.kind == "pose":
                face.pose(int(key), 0, window, warm=False)
            else:
                face.detail(int(key), 0, window)
            session.commit()
        seconds = time.perf_counter() - began
        said.append({"name": row.name, "kind": row.kind, "vertices": vertices, "frames": frames, "edited": row.edited})
        said[-1] |= {"paper_s": row.seconds, "ours_s": seconds}
        print(
            f"{row.name:<16}{row.kind:<8}{vertices:>10,}{frames:>8}{row.edited:>8}{row.seconds:>9.0f}{seconds:>9.2f}"
            f"{row.seconds / seconds:>8.1f}",
            flush=True,
        )
        shutil.rmtree(work / f"row{number}", ignore_errors=True)  # up to 10 GiB
    return said


def _opened(folder: Path, vertices: int, frames: int, bases: int, takes: Path | None) -> EditSession:
    """A session on a fresh shot of the sample performer."""
    folder.mkdir()
    write_shot(folder, vertices, frames, bases, takes)
    shot = Shot(folder)
    run_stages(shot, ["transfer"])
    return EditSession.open(shot)


def _median(work: Callable[[int], object], runs: int) -> float:
    seconds = []
    for run in range(runs):
        began = time.perf_counter()
        work(run)
        seconds.append(time.perf_counter() - began)
    return float(np.median(seconds))


def _parser() -> argparse.ArgumentParser:
    listed = "\n".join(
        f"  {k} {r.name}: {r.kind}, {r.vertices:,} x {r.frames} x {r.bases}, {r.edited} frames edited"
        for k, r in enumerate(TABLE_2, 1)
    )
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=f"rows of Table 2:\n{listed}", formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--vertices", type=int, default=80_000, help="vertices of the face (%(default)s)")
    parser.add_argument("--frames", type=int, default=1300, help="frames of the take (%(default)s)")
    parser.add_argument("--bases", type=int, default=28, help="bases K (%(default)s)")
    parser.add_argument("--points", type=int, default=12, help="points that a pose edit pulls (%(default)s)")
    parser.add_argument("--region", type=int, default=5000, help="vertices of a detail edit (%(default)s)")
    parser.add_argument("--window", type=int, default=100, help="frames of a window (%(default)s)")
    parser.add_argument("--runs", type=int, default=5, help="runs to take the median of (%(default)s)")
    parser.add_argument(
        "--table2", type=int, nargs="+", choices=range(1, 6), default=[], metavar="N", help="rows to run"
    )
    parser.add_argument("--share", type=float, default=1.0, help="share of Table 2's vertices and frames to run (1)")
    parser.add_argument("--no-section6", action="store_true", help="only Table 2")
    parser.add_argument("--work", type=Path, help="where to put the shots; 6 GiB, 16 for row 5")
    parser.add_argument("--takes", type=Path, metavar="DIR", help="keep the takes here, for the next time")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    return parser


if __name__ == "__main__":
    sys.exit(main())
