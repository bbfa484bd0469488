#!/usr/bin/env python3
"""How near the registration comes to the true correspondence, head by head.

Heads: the project's samples, and with ``--ict PERFORMER IDENTITY`` the ICT performer onto another person. The child's
row is marked as held out: nothing was ever tuned on it.
Errors are distances to the true corresponding point, as a share of the face's height (menton to hairline, on the
target). The face is the skin in front of three planes: through both tragi and the hairline, through both tragi and the
jaw's corners, through the jaw's corners and the menton; without what lies behind lips and lids. "Lips" and "lids" are
the parts of it within 1 cm of their rims. A vertex is on the wrong sheet if the true surface of the other lip or lid is
nearer to it than that of its own by half a millimetre, a triangle is flipped if its normal opposes the true one.

30 landmarks come with the source's own rims (they say what is interior, and nothing about the target), 45 with feature
lines on both faces: rims of lids and lips, and as guides the lines that an artist draws over the rest of a face (folds
of the lids, midline, brows, wings of the nose, nasolabial folds, jaw, cheekbones, temples, from the mouth's corners
to chin and ears); the samples bring them along. Every pick on the target is the vertex nearest to the true point, as a
careful user makes it: off by up to half an edge.

``--floor`` prints instead how near a smooth displacement comes that knows the target's true surface, and where the
truth itself goes when only what the registration knows holds it; see ``_registration/floor.py``.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._registration.floor import drifted, floor, relief_misfits  # noqa: E402
from benchmarks._registration.heads import Head, sample_heads  # noqa: E402
from benchmarks._registration.ict import ict_head  # noqa: E402
from toolkit.feature_lines import FeatureLine  # noqa: E402
from toolkit.mesh import face_normals, triangle_areas  # noqa: E402
from toolkit.registration import Landmarks, Registration, register  # noqa: E402
from toolkit.registration.curves import loops_of, sheet_labels, source_rims  # noqa: E402
from toolkit.registration.interior import behind_loops  # noqa: E402
from toolkit.registration.surface import Surface  # noqa: E402

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

HELD_OUT = ("child",)
"""Heads by which nothing was chosen: neither parameters nor landmarks nor lines."""


def main() -> int:
    """Print the table."""
    options = _parser().parse_args()
    rows = _floors(options) if options.floor else _measured(options)
    if options.json:
        print(json.dumps({"rows": rows}))
    return 0


def _measured(options: argparse.Namespace) -> list[dict[str, float | str]]:
    rows = []
    columns = ("mean %", "95 %", "lips", "lids", "sheet", "flips", "s", "CPU s")
    print(f"{'head':<14}{'marks':>6}" + "".join(f"{column:>8}" for column in columns))
    for head in _heads(options):
        for count in options.landmarks:
            row = measure(head, count)
            rows.append(row)
            print(
                f"{row['head']:<14}{row['landmarks']:>6}{row['mean']:>8.3f}{row['p95']:>8.2f}{row['lips']:>8.3f}"
                f"{row['lids']:>8.3f}{row['wrong_sheet']:>8.2f}{row['flips']:>8.2f}{row['seconds']:>8.1f}"
                f"{row['cpu_seconds']:>8.1f}" + ("  held out" if head.name in HELD_OUT else ""),
                flush=True,
            )
    return rows


def _floors(options: argparse.Namespace) -> list[dict[str, float | str]]:
    """Best smooth answers in hindsight, whether relief prefers the truth to them where they differ, and the drift."""
    print(
        f"{'head':<14}{'marks':>6}{'mean %':>8}{'lips':>7}{'lids':>7}  drift: mean, lips, lids relief: true, there off"
    )
    rows: list[dict[str, float | str]] = []
    for head in _heads(options):
        skin = ~behind_loops(head.source, loops_of(source_rims(head.lines, head.source)))
        for count in options.landmarks:
            lines, marks = _known(head, count)
            best = floor(head.source, head.truth, head.region, marks.source, head.lines if count == 45 else [], skin)
            own = {key: _error(head, answer.vertices, key) for key, answer in best.items()}
            gone = drifted(head.source, head.target, head.truth, marks, lines)
            drift = {f"{key}_drift": _error(head, gone, key) for key in head.region}
            true, there, off = relief_misfits(
                head.source, head.target, head.truth, best["face"].vertices, head.region["face"], head.height
            )
            relief = {"relief_true": true, "relief_there": there, "off": off}
            rows.append({"head": head.name, "landmarks": count, **own, **drift, **relief})
            print(
                f"{head.name:<14}{count:>6}{own['face']:>8.3f}{own['lips']:>7.3f}{own['lids']:>7.3f}"
                + " " * 10
                + "".join(f"{value:>7.3f}" for value in drift.values())
                + f"{true:>15.4f}{there:>8.4f}{100 * off:>8.0f} %",
                flush=True,
            )
    return rows


def _known(head: Head, count: int) -> tuple[list[FeatureLine], Landmarks]:
    """What the registration is given: with 30 landmarks the lines are on the source only."""
    lines = head.lines if count == 45 else [replace(line, target_vertices=None) for line in head.lines]
    return lines, head.marks[count]


def _error(head: Head, vertices: Array, region: str) -> float:
    """Mean distance to the truth over a region, percent of the face's height."""
    return float(100 * np.linalg.norm(vertices - head.truth, axis=1)[head.region[region]].mean() / head.height)


def measure(head: Head, count: int) -> dict[str, float | str]:
    """Register one head with 30 landmarks, or 45 and lines, and compare with the truth; errors in percent."""
    lines, marks = _known(head, count)
    start, worked = time.perf_counter(), time.process_time()
    result = register(head.source, head.target, marks, lines)
    seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - worked
    error = 100 * np.linalg.norm(result.vertices - head.truth, axis=1) / head.height
    return {
        "head": head.name,
        "landmarks": len(marks),
        "mean": _error(head, result.vertices, "face"),
        "p95": float(np.percentile(error[head.region["face"]], 95)),
        "lips": _error(head, result.vertices, "lips"),
        "lids": _error(head, result.vertices, "lids"),
        "wrong_sheet": 100 * _wrong(head, result),
        "flips": 100 * _flipped(head, result),
        "seconds": seconds,
        "cpu_seconds": cpu_seconds,
    }


def _wrong(head: Head, result: Registration) -> float:
    """Share of the vertices near lips and lids that lie on the true surface's other sheet."""
    true = head.source.with_vertices(head.truth)
    rims = source_rims(head.lines, head.source)
    labels = sheet_labels(true, ~behind_loops(head.source, loops_of(rims)), rims, on_target=False)
    wrong, judged = 0, 0
    for values in labels.values():
        for side in (1, -1):
            mine = np.flatnonzero(values == side)
            own, other = (
                Surface(true, np.flatnonzero((values[true.triangles] == s).all(axis=1))) for s in (side, -side)
            )
            distance = [s.closest(result.vertices[mine]).distance for s in (own, other)]
            wrong += int(np.count_nonzero(distance[1] + head.height / 360 < distance[0]))
            judged += len(mine)
    return wrong / max(judged, 1)


def _flipped(head: Head, result: Registration) -> float:
    triangles = head.source.triangles
    areas = triangle_areas(head.truth, triangles)
    judged = head.region["face"][triangles].all(axis=1) & (areas > 1e-3 * np.median(areas))
    true, found = face_normals(head.truth, triangles), face_normals(result.vertices, triangles)
    return float(np.mean(np.einsum("fd,fd->f", true, found)[judged] < 0))


def _heads(options: argparse.Namespace) -> Iterator[Head]:
    if options.ict:
        yield ict_head(*options.ict)
    yield from sample_heads(options.heads, options.level, options.cache)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--heads",
        nargs="*",
        default=["asian_female", "african_old", "orc", "hound", *HELD_OUT],
        help="sample targets; nothing after it for none",
    )
    parser.add_argument("--level", type=int, default=2, choices=[0, 1, 2], help="resolution of the samples")
    parser.add_argument("--landmarks", nargs="+", type=int, default=[30, 45], choices=[30, 45])
    parser.add_argument("--ict", nargs=2, type=Path, metavar=("PERFORMER", "IDENTITY"), help="folders of the ICT pair")
    parser.add_argument("--floor", action="store_true", help="print how near an oracle with the true surface comes")
    parser.add_argument("--cache", type=Path, help="folder of the samples")
    parser.add_argument("--json", action="store_true", help="print one JSON object last")
    return parser


if __name__ == "__main__":
    sys.exit(main())
