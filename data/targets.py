"""The target faces: other heads, another topology, another unit and pose, with the known answer beside them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from data.files import write_json, write_ply
from data.guides import guide_lines, guide_stops
from data.heads import PERFORMER, SHAPES, Head, build_head, eyeballs
from data.layout import LEVELS, Layout, hand_made, load_layout
from data.package import Package
from data.remeshing import Density, Hole, Remesh, remesh, split_quads
from toolkit.feature_lines import FeatureLine, save_feature_lines
from toolkit.mesh import TriangleMesh

__all__ = ["ARCS", "RIMS", "TARGETS", "Truth", "build_target"]

Array = NDArray[np.float64]

TARGETS: tuple[str, ...] = ("asian_female", "african_old", "orc", "hound", "child")
"""The child is held out: no parameter of the registration was ever chosen by it."""

ARCS = ("eyelid_left", "eyelid_right", "lip_inner", "lip_outer")
"""Openings whose rim is given as ``<name>_upper`` and ``<name>_lower``, corner to corner, and whole as ``<name>``."""
RIMS = {"eyelid_left": "eyelid_rim_left", "eyelid_right": "eyelid_rim_right", "lip_inner": "lip_inner"}

_EDGES = {0: (1.0, 0.55, 0.30, 0.20), 1: (0.60, 0.33, 0.18, 0.11), 2: (0.34, 0.19, 0.11, 0.06)}
"""Edge lengths in cm of the skull, the face, the rims of lips and nostrils, and the lids, by level."""
_RESHAPED = {"jawOpen": 0.35, "eyeBlinkLeft": 0.5, "eyeBlinkRight": 0.5}
"""The pose in which a head is re-meshed. The lips are apart, so that closest points never find the other one, and the
lids half shut: at rest most of the upper lid's skin is folded away, and would get no vertices to unfold with."""


@dataclass(frozen=True)
class Truth:
    """The known answer on one target, in the unit and pose of its file.

    ``neutral`` (4326, 3) and ``offsets`` (52, 4326, 3) are control points; ``subdivide`` (V, 4326) makes the
    performer's vertices of them, ``own`` (V', 4326) the target file's own ones.
    """

    neutral: Array
    offsets: Array
    subdivide: sp.csr_matrix
    own: sp.csr_matrix

    def control(self, weights: Array) -> Array:
        """Control points ``(4326, 3)`` of the expression ``weights`` (52,) in the order of ``SHAPES``."""
        return self.neutral + np.tensordot(np.asarray(weights, dtype=np.float64), self.offsets, 1)

    def shape(self, weights: Array) -> Array:
        """Where each of the performer's vertices truly lies on this head, ``(V, 3)``, without wrinkles."""
        return np.asarray(self.subdivide @ self.control(weights))

    def own_shape(self, weights: Array) -> Array:
        """The expression on the target file's own vertices ``(V', 3)``."""
        return np.asarray(self.own @ self.control(weights))

    @classmethod
    def load(cls, truth: Path, subdivision: Path) -> Truth:
        """Read ``truth.npz`` of a target and ``subdivision.npz`` of the performer of the same level."""
        with np.load(truth) as held:
            own = sp.csr_matrix((held["own_data"], held["own_indices"], held["own_indptr"]), tuple(held["own_shape"]))
            neutral, offsets = held["neutral"], held["offsets"].astype(np.float64)
        return cls(neutral, offsets, sp.csr_matrix(sp.load_npz(subdivision)), own)


def build_target(package: Package, name: str, level: int, folder: Path) -> None:
    """Write one target's files into ``folder``: reference.ply, truth.npz, landmarks and feature lines."""
    layout, head = load_layout(package), build_head(package, name)
    made = _another_topology(layout, head, level)
    pose = _Pose(hand_made("targets")[name])
    own = (made.places @ layout.subdivision.matrix).tocsr()
    neutral = pose.points(head.neutral)
    vertices = (own @ neutral).astype(np.float32)
    write_ply(folder / "reference.ply", vertices, made.triangles)
    eyes, eye_triangles = eyeballs(package, head.eyes)
    write_ply(folder / "eyes.ply", pose.points(eyes).astype(np.float32), eye_triangles)
    np.savez_compressed(
        folder / "truth.npz",
        neutral=neutral,
        offsets=pose.vectors(head.offsets).astype(np.float32),
        own_data=own.data,
        own_indices=own.indices,
        own_indptr=own.indptr,
        own_shape=np.array(own.shape),
    )
    on_head = layout.subdivision.matrix @ neutral
    for count, names in hand_made("landmark_sets").items():
        file = folder / ("landmarks.json" if count == "45" else f"landmarks_{count}.json")
        write_json(file, {"pairs": _landmarks(layout, names, on_head, vertices, made)})
    performer = build_head(package, PERFORMER).neutral
    lines = feature_lines(layout, level, made.lines) + _guides(layout, level, performer, on_head, vertices, made)
    save_feature_lines(folder / "feature_lines.json", lines)


def feature_lines(layout: Layout, level: int, on_target: dict[str, list[int]] | None = None) -> list[FeatureLine]:
    """Lines round lids and lips: full edge paths on the performer and, where known, on the target."""
    lines = []
    for name in ARCS:
        arcs = [f"{name}_upper", f"{name}_lower"]
        source = [layout.arc(arc, level) for arc in arcs]
        target = [on_target[arc] for arc in arcs] if on_target else None
        for k, arc in enumerate(arcs):
            lines.append(_line(arc, False, source[k], target[k] if target else None))
        lines.append(_line(name, True, _round(*source), _round(*target) if target else None))
    return lines


def _line(name: str, closed: bool, source: list[int], target: list[int] | None) -> FeatureLine:
    return FeatureLine(name, closed, np.array(source), None if target is None else np.array(target))


def _guides(
    layout: Layout, level: int, performer: Array, on_head: Array, vertices: NDArray[np.float32], made: Remesh
) -> list[FeatureLine]:
    """The guides, drawn over the performer without its relief."""
    count = layout.subdivision.counts[level]
    source = TriangleMesh(layout.subdivision.matrix[:count] @ performer, split_quads(layout.quads(level)))
    target = TriangleMesh(vertices.astype(np.float64), made.triangles)
    ends = [on_head[layout.landmarks[name]] for name in ("menton", "forehead_high")]
    height = float(np.linalg.norm(ends[1] - ends[0]))
    return guide_lines(source, target, on_head[:count], guide_stops(layout, level), height)


def _round(upper: list[int], lower: list[int]) -> list[int]:
    return [*upper, *lower[-2:0:-1]]


def _another_topology(layout: Layout, head: Head, level: int) -> Remesh:
    weights = np.array([_RESHAPED.get(shape, 0.0) for shape in SHAPES])
    reshaped = layout.subdivision.matrix @ head.shape(weights)
    skull, face, rim, lid = _EDGES[level]
    lids = _around(layout, "eyelid_rim_left", "eyelid_rim_right")
    features = _around(layout, "lip_inner", "lip_outer", "nostril_rim_left", "nostril_rim_right") + lids
    ears = _around(layout, "ear_helix_left", "ear_helix_right")
    densities = [
        Density(lid, ((0.5, lids),)),
        Density(rim, ((0.8, features), (1.3, lids), (0.4, ears))),
        Density(face, ((3.5, features), (1.5, ears))),
        Density(skull),
    ]
    lines = {name: layout.arc(name, LEVELS) for name in ("lip_outer_upper", "lip_outer_lower")}
    holes = [_hole(layout, name, loop, min(level, 1)) for name, loop in RIMS.items()]
    return remesh(reshaped, layout.quads(LEVELS), holes, densities, lines)


def _around(layout: Layout, *loops: str) -> tuple[int, ...]:
    return tuple(v for loop in loops for v in layout.loop(loop, LEVELS))


def _hole(layout: Layout, name: str, loop: str, inner_level: int) -> Hole:
    behind = layout.behind(loop)
    return Hole(
        name,
        layout.arc(f"{name}_upper", LEVELS),
        layout.arc(f"{name}_lower", LEVELS),
        layout.quads(LEVELS)[np.repeat(behind, 4**LEVELS)],
        layout.quads(inner_level)[np.repeat(behind, 4**inner_level)],
    )


def _landmarks(
    layout: Layout, names: list[str], on_head: Array, vertices: NDArray[np.float32], made: Remesh
) -> list[dict[str, Any]]:
    """Pairs whose target is the nearest vertex of the re-meshed head; on a line, the nearest vertex of that line."""
    pairs = []
    for name in names:
        source = layout.landmarks[name]
        line = next((arc for arc in made.lines if source in layout.arcs[arc]), None)
        among = np.arange(len(vertices)) if line is None else np.array(made.lines[line])
        nearest = int(among[np.argmin(np.linalg.norm(vertices[among] - on_head[source], axis=1))])
        pairs.append({"name": name, "source": source, "target": nearest})
    return pairs


class _Pose:
    """From centimetres at the eyes to a target file's unit, orientation and origin."""

    def __init__(self, given: dict[str, Any]) -> None:
        turn = np.eye(3)
        for axis, angle in enumerate(np.radians(given["rotate_degrees"])):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            about = np.eye(3)
            about[i, i] = about[j, j] = np.cos(angle)
            about[i, j], about[j, i] = -np.sin(angle), np.sin(angle)
            turn = about @ turn
        self._map = given["scale"] * np.round(turn, 15)
        self._shift = np.array(given["translate"], dtype=np.float64)

    def points(self, points: Array) -> Array:
        return self.vectors(points) + self._shift

    def vectors(self, vectors: Array) -> Array:
        return vectors @ self._map.T
