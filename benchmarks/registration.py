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
lines on both faces: rims of lids and lips, and the lines that an artist draws over the rest of a face (midline, brows,
wings of the nose, nasolabial folds, jaw, cheekbones, temples, from the corners of the mouth to chin and ears). Every
pick on the target is the vertex nearest to the true point, as a careful user makes it: off by up to half an edge.

``--floor`` prints instead how near a smooth displacement comes that knows the target's true surface; see
``_registration/floor.py``.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from benchmarks._registration.floor import floor, relief_misfits  # noqa: E402
from benchmarks._registration.guides import guide_lines, ict_stops, sample_stops  # noqa: E402
from toolkit.feature_lines import FeatureLine, load_feature_lines, shortest_edge_path  # noqa: E402
from toolkit.mesh import TriangleMesh, face_normals, triangle_areas  # noqa: E402
from toolkit.meshio import read_mesh  # noqa: E402
from toolkit.registration import Landmarks, Registration, register  # noqa: E402
from toolkit.registration.curves import loops_of, sheet_labels, source_rims  # noqa: E402
from toolkit.registration.interior import behind_loops  # noqa: E402
from toolkit.registration.surface import Surface  # noqa: E402

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

PAIRED_30 = "eye_inner eye_outer lid_upper_mid lid_lower_mid mouth_corner lip_upper_outer_quarter nose_ala cheek_bone"
PAIRED_30 += " cheek_mid jaw_gonion brow_outer temple"
SINGLE_30 = "lip_upper_outer_mid lip_lower_outer_mid nasion nose_tip menton forehead_high"
PAIRED_45 = PAIRED_30 + " lip_lower_outer_quarter tragus chin_side jaw_mid brow_inner forehead_side"
SINGLE_45 = SINGLE_30 + " lip_upper_inner_mid lip_lower_inner_mid subnasale"
HELD_OUT = ("child",)
"""Heads by which nothing was chosen: neither parameters nor landmarks nor lines."""


@dataclass(frozen=True)
class Head:
    """One pair of faces with its known answer; ``region`` masks (V,) by name, ``names`` landmark to source vertex."""

    name: str
    source: TriangleMesh
    target: TriangleMesh
    truth: Array
    lines: list[FeatureLine]
    guides: list[FeatureLine]
    marks: dict[int, list[int]]
    height: float
    region: dict[str, Mask]


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
    """Best smooth answer in hindsight, and whether relief prefers the truth to it where the two differ."""
    print(f"{'head':<14}{'marks':>6}{'mean %':>8}{'lips':>7}{'lids':>7}  relief at truth / there    off")
    rows: list[dict[str, float | str]] = []
    for head in _heads(options):
        skin = ~behind_loops(head.source, loops_of(source_rims(head.lines, head.source)))
        for count in options.landmarks:
            lines = [*head.lines, *head.guides] if count == 45 else []
            best = floor(head.source, head.truth, head.region["face"], np.array(head.marks[count]), lines, skin)
            error = 100 * np.linalg.norm(best.vertices - head.truth, axis=1) / head.height
            mean = {key: float(error[mask].mean()) for key, mask in head.region.items()}
            true, there, off = relief_misfits(
                head.source, head.target, head.truth, best.vertices, head.region["face"], head.height
            )
            rows.append({"head": head.name, "landmarks": count, **mean, "relief_true": true, "relief_there": there})
            print(
                f"{head.name:<14}{len(head.marks[count]):>6}{mean['face']:>8.3f}{mean['lips']:>7.3f}{mean['lids']:>7.3f}"
                f"{true:>11.4f} / {there:.4f}{100 * off:>9.0f} %",
                flush=True,
            )
    return rows


def measure(head: Head, count: int) -> dict[str, float | str]:
    """Register one head with 30 landmarks, or 45 and lines, and compare with the truth; errors in percent."""
    lines = (
        [*head.lines, *head.guides] if count == 45 else [FeatureLine(x.name, x.closed, x.vertices) for x in head.lines]
    )
    marks = _picked(head, count)
    start, worked = time.perf_counter(), time.process_time()
    result = register(head.source, head.target, marks, lines)
    seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - worked
    error = 100 * np.linalg.norm(result.vertices - head.truth, axis=1) / head.height
    face, lips, lids = head.region["face"], head.region["lips"], head.region["lids"]
    return {
        "head": head.name,
        "landmarks": len(marks),
        "mean": float(error[face].mean()),
        "p95": float(np.percentile(error[face], 95)),
        "lips": float(error[lips].mean()),
        "lids": float(error[lids].mean()),
        "wrong_sheet": 100 * _wrong(head, result),
        "flips": 100 * _flipped(head, result),
        "seconds": seconds,
        "cpu_seconds": cpu_seconds,
    }


def _picked(head: Head, count: int) -> Landmarks:
    """Target vertices nearest to the truth; those of a line are looked for on the target's line."""
    whole = cKDTree(head.target.vertices)
    source = head.marks[count]
    target = []
    for vertex in source:
        point = head.truth[vertex]
        line = next((x for x in head.lines if x.target_vertices is not None and vertex in x.vertices), None)
        if line is None or line.target_vertices is None:
            target.append(int(whole.query(point)[1]))
        else:
            path = shortest_edge_path(head.target.vertices, head.target.triangles, line.target_vertices, line.closed)
            target.append(int(path[np.argmin(np.linalg.norm(head.target.vertices[path] - point, axis=1))]))
    return Landmarks.of(source, target, [f"landmark {k}" for k in source])


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
        yield _ict(*options.ict)
    if options.heads:
        from data.samples import ensure_samples

        samples = ensure_samples(options.cache, targets=options.heads, level=options.level)
        source = read_mesh(samples.performer.reference)
        names = json.loads(samples.performer.landmarks.read_text(encoding="utf-8"))
        for name in options.heads:
            paths = samples.targets[name]
            truth = samples.truth(name).shape(np.zeros(52))
            lines = load_feature_lines(paths.feature_lines)
            yield _head(name, source, read_mesh(paths.reference), truth, lines, names)


def _head(
    name: str, source: TriangleMesh, target: TriangleMesh, truth: Array, lines: list[FeatureLine], names: dict[str, int]
) -> Head:
    at = {key: source.vertices[vertex] for key, vertex in names.items()}
    left, right, tip = at["tragus_l"], at["tragus_r"], at["nose_tip"]
    jaw = (at["jaw_gonion_l"], at["jaw_gonion_r"])
    face = np.ones(source.n_vertices, dtype=bool)
    for a, b, c in ((left, right, at["forehead_high"]), (left, right, jaw[0]), (*jaw, at["menton"])):
        normal = np.cross(b - a, c - a)
        face &= (source.vertices - a) @ (normal * np.sign(normal @ (tip - a))) > 0
    marks = {
        30: [names[x] for x in _both(PAIRED_30) + SINGLE_30.split()],
        45: [names[x] for x in _both(PAIRED_45) + SINGLE_45.split()],
    }
    height = float(np.linalg.norm(truth[names["menton"]] - truth[names["forehead_high"]]))
    guides = guide_lines(source, target, truth, sample_stops(names), height)
    return Head(
        name, source, target, truth, lines, guides, marks, height, _regions(source, truth, lines, face, height / 18)
    )


def _both(words: str) -> list[str]:
    return [f"{word}_{side}" for word in words.split() for side in "lr"]


def _regions(source: TriangleMesh, truth: Array, lines: list[FeatureLine], face: Mask, cm: float) -> dict[str, Mask]:
    face = face & ~behind_loops(source, loops_of(source_rims(lines, source)))
    regions = {"face": face}
    for key, words in (("lips", ("lip_inner", "inner_lip")), ("lids", ("lid",))):
        rim = np.concatenate([line.vertices for line in lines if any(word in line.name for word in words)])
        regions[key] = face & (cKDTree(truth[rim]).query(truth)[0] < cm)
    return regions


def _ict(performer: Path, identity: Path) -> Head:
    """The ICT pair; its 68 landmarks lack cheeks and forehead, so some are picked by place."""
    sys.path.insert(0, str(performer))
    import bake  # type: ignore[import-not-found]

    made = bake.Performer()
    source = TriangleMesh(made.frame(np.zeros(len(made.expressions))), made.triangles.astype(np.int32))
    target = read_mesh(identity / "face_remeshed.ply")
    truth = np.load(identity / "true_correspondence.npy").astype(np.float64)
    marks = json.loads((performer / "landmarks.json").read_text(encoding="utf-8"))["landmarks68"]
    given = json.loads((performer / "feature_lines.json").read_text(encoding="utf-8"))["lines"]
    p = source.vertices[marks]
    middle = np.abs(source.vertices[:, 0] - p[27, 0]) < 0.15
    hairline = int(np.flatnonzero(middle)[np.argmax(source.vertices[middle, 1])])
    height = float(np.linalg.norm(truth[marks[8]] - truth[hairline]))
    lines = _ict_lines(source, target, truth, given, marks)
    face = (source.vertices[:, 1] > p[8, 1]) & (source.vertices[:, 1] <= source.vertices[hairline, 1])
    face &= np.abs(source.vertices[:, 0] - p[27, 0]) < abs(p[0, 0] - p[16, 0]) / 2
    extra = _ict_extra(source.vertices, p, source.vertices[hairline, 1])
    first = [0, 4, 8, 12, 16, 17, 21, 22, 26, 27, 30, 31, 33, 35, 36, 39, 42, 45, 37, 41, 44, 46, 48, 54, 51, 57]
    more = [6, 10, 19, 24, 38, 40, 43, 47, 50, 52, 62, 66]
    sets = {
        30: [marks[k] for k in first] + extra[:4],
        45: [marks[k] for k in sorted(first + more)] + extra,
    }
    guides = guide_lines(source, target, truth, ict_stops(marks, extra), height)
    return Head(
        "ict", source, target, truth, lines, guides, sets, height, _regions(source, truth, lines, face, height / 18)
    )


def _ict_extra(vertices: Array, p: Array, top: float) -> list[int]:
    """Temples, cheek bones, cheeks and forehead, by where they are from in front."""

    def at(x: float, y: float) -> int:
        near = np.argsort((vertices[:, 0] - x) ** 2 + (vertices[:, 1] - y) ** 2)[:5]
        return int(near[np.argmax(vertices[near, 2])])

    places = [(1.02 * p[17, 0], 0.45 * p[17, 1] + 0.55 * top), (1.02 * p[26, 0], 0.45 * p[26, 1] + 0.55 * top)]
    for jaw, eye in ((0, 36), (16, 45)):
        places.append((0.62 * p[jaw, 0] + 0.38 * p[eye, 0], 0.35 * p[30, 1] + 0.65 * p[eye, 1]))
    for jaw, corner in ((3, 48), (13, 54)):
        places.append((0.6 * p[jaw, 0] + 0.4 * p[corner, 0], 0.5 * (p[corner, 1] + p[30, 1])))
    places.append((p[27, 0], top - 0.4))
    return [at(*place) for place in places]


def _ict_lines(
    source: TriangleMesh, target: TriangleMesh, truth: Array, given: list[dict], marks: list[int]
) -> list[FeatureLine]:
    """Rims as upper and lower lines; on the target about a dozen vertices near the true line, as picked by hand."""
    tree, lines = cKDTree(target.vertices), []
    for line in given:
        corners = {"eyelid_left_of_picture": (36, 39), "eyelid_right_of_picture": (42, 45), "inner_lip": (60, 64)}
        first, last = corners.get(line["name"], (48, 54))
        ring = shortest_edge_path(source.vertices, source.triangles, line["vertices"], True)
        ends = [
            int(np.argmin(np.linalg.norm(source.vertices[ring] - source.vertices[marks[k]], axis=1)))
            for k in (first, last)
        ]
        turned, split = np.roll(ring, -ends[0]), (ends[1] - ends[0]) % len(ring)
        halves = [turned[: split + 1], np.append(turned[split:], turned[0])[::-1]]
        halves.sort(key=lambda ids: -source.vertices[ids, 1].mean())
        for side, ids in zip(("upper", "lower"), halves, strict=True):
            spread = np.unique(np.linspace(0, len(ids) - 1, max(9, len(ids) // 12)).round().astype(int))
            near = tree.query(truth[ids[spread]])[1]
            near = near[np.append(True, near[1:] != near[:-1])]
            lines.append(FeatureLine(f"{line['name']}_{side}", False, ids, near.astype(np.int64)))
    return lines


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
