"""The ICT pair: the performer onto another person of the same model, re-meshed."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks._registration.heads import Head, regions
from data.guides import guide_lines
from toolkit.feature_lines import FeatureLine, shortest_edge_path
from toolkit.mesh import TriangleMesh
from toolkit.meshio import read_mesh
from toolkit.registration import Landmarks

__all__ = ["ict_head"]

Array = NDArray[np.float64]

_LIDS = {
    "lid_crease_r": [86449, 32348, 82483, 41411, 33245, 82167, 84602],
    "lid_crease_l": [2908, 12982, 22805, 49651, 90300, 90960, 49676, 90326],
    "lid_fold_r": [36698, 36656, 1084, 36276, 37980, 20989],
    "lid_fold_l": [52903, 55152, 53440, 3304, 53809, 23222],
}
"""Vertices along the creases above and the folds below the lids, picked by eye."""


def ict_head(performer: Path, identity: Path) -> Head:
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
    lines = _lines(source, target, truth, given, marks)
    face = (source.vertices[:, 1] > p[8, 1]) & (source.vertices[:, 1] <= source.vertices[hairline, 1])
    face &= np.abs(source.vertices[:, 0] - p[27, 0]) < abs(p[0, 0] - p[16, 0]) / 2
    extra = _extra(source.vertices, p, source.vertices[hairline, 1])
    first = [0, 4, 8, 12, 16, 17, 21, 22, 26, 27, 30, 31, 33, 35, 36, 39, 42, 45, 37, 41, 44, 46, 48, 54, 51, 57]
    more = [6, 10, 19, 24, 38, 40, 43, 47, 50, 52, 62, 66]
    sets = {30: [marks[k] for k in first] + extra[:4], 45: [marks[k] for k in sorted(first + more)] + extra}
    picks = {count: _picked(target, truth, lines, ids) for count, ids in sets.items()}
    judged = regions(source, truth, lines, face, height / 18)
    lines = lines + guide_lines(source, target, truth, _stops(marks, extra), height)
    return Head("ict", source, target, truth, lines, picks, height, judged)


def _picked(target: TriangleMesh, truth: Array, lines: list[FeatureLine], source: list[int]) -> Landmarks:
    """Target vertices nearest to the truth; those of a line are looked for on the target's line."""
    whole = cKDTree(target.vertices)
    found = []
    for vertex in source:
        point = truth[vertex]
        line = next((x for x in lines if x.target_vertices is not None and vertex in x.vertices), None)
        if line is None or line.target_vertices is None:
            found.append(int(whole.query(point)[1]))
        else:
            path = shortest_edge_path(target.vertices, target.triangles, line.target_vertices, line.closed)
            found.append(int(path[np.argmin(np.linalg.norm(target.vertices[path] - point, axis=1))]))
    return Landmarks.of(source, found, [f"landmark {k}" for k in source])


def _extra(vertices: Array, p: Array, top: float) -> list[int]:
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


def _lines(
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


def _stops(marks: list[int], extra: list[int]) -> dict[str, list[int]]:
    """Where the guides lead, through the 68 landmarks and the points picked by place."""
    m, (temple_r, temple_l, bone_r, bone_l, cheek_r, cheek_l, top) = marks, extra
    return {
        "midline_upper": [top, *m[27:31], m[33], m[51]],
        "midline_lower": [m[57], m[8]],
        "brow_r": m[17:22],
        "brow_l": m[22:27],
        "nose_wing_r": [m[33], m[32], m[31]],
        "nose_wing_l": [m[33], m[34], m[35]],
        "nasolabial_fold_r": [m[31], m[48]],
        "nasolabial_fold_l": [m[35], m[54]],
        "corner_to_chin_r": [m[48], m[6]],
        "corner_to_chin_l": [m[54], m[10]],
        "jaw_r": m[8::-1],
        "jaw_l": m[8:17],
        "cheekbone_r": [m[0], bone_r, m[31]],
        "cheekbone_l": [m[16], bone_l, m[35]],
        "temporal_r": [m[17], temple_r, top],
        "temporal_l": [m[26], temple_l, top],
        "corner_to_ear_r": [m[48], cheek_r, m[1]],
        "corner_to_ear_l": [m[54], cheek_l, m[15]],
        **_LIDS,
    }
