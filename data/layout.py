"""What is known about the base mesh by hand: landmarks, loops, arcs, the head crop (``samples/*.json``)."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from data.package import Package
from data.subdivision import Subdivision, catmull_clark

__all__ = ["LEVELS", "Layout", "hand_made", "load_layout"]

LEVELS = 2
"""Rounds of subdivision of the full-resolution samples: 4,326 vertices become 68,949."""


def hand_made(name: str) -> Any:
    """Return the contents of ``data/samples/<name>.json``."""
    path = Path(__file__).resolve().parent / "samples" / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Layout:
    """The cropped head, the same for all sample faces.

    ``base_ids`` (4326,) ids in the package's mesh of the head's vertices; all else counts along them:
    ``skin`` (4304,) faces outside the mouth bag and the eye sockets, ``landmarks`` name to vertex, ``loops`` and
    ``arcs`` name to an edge path (a loop does not repeat its first vertex), ``rings`` quad loops round an eye or the
    mouth, outermost first, their columns aligned, ``subdivision`` the operator of the full-resolution mesh.
    """

    base_ids: NDArray[np.int64]
    skin: NDArray[np.bool_]
    landmarks: dict[str, int]
    loops: dict[str, list[int]]
    arcs: dict[str, list[int]]
    rings: dict[str, list[list[int]]]
    subdivision: Subdivision

    def quads(self, level: int) -> NDArray[np.int64]:
        """Faces after ``level`` rounds, ``(4304 * 4**level, 4)``."""
        return self.subdivision.quads[level]

    def skin_quads(self, level: int) -> NDArray[np.int64]:
        """Those of them that are skin: the four children of a face follow each other."""
        return self.quads(level)[np.repeat(self.skin, 4**level)]

    def behind(self, loop: str) -> NDArray[np.bool_]:
        """Mask ``(4304,)`` of the base faces behind a rim: those cut off from the rest of the head by the loop."""
        cut = {frozenset(side) for side in pairwise([*self.loops[loop], self.loops[loop][0]])}
        faces = self.quads(0)
        owners: dict[frozenset[int], int] = {}
        joined = []
        for face, quad in enumerate(faces.tolist()):
            for k in range(4):
                side = frozenset((quad[k], quad[k - 1]))
                other = owners.setdefault(side, face)
                if other != face and side not in cut:
                    joined.append((face, other))
        rows, cols = np.array(joined).T
        graph = sp.csr_matrix((np.ones(len(rows)), (rows, cols)), shape=(len(faces),) * 2)
        labels = connected_components(graph, directed=False)[1]
        return np.asarray(labels != np.bincount(labels).argmax())

    def arc(self, name: str, level: int) -> list[int]:
        """Return an open line as an edge path after ``level`` rounds."""
        return self.subdivision.refine_path(self.arcs[name], level)

    def loop(self, name: str, level: int) -> list[int]:
        """Return a closed line as an edge path after ``level`` rounds; the first vertex is not repeated."""
        loop = self.loops[name]
        return self.subdivision.refine_path([*loop, loop[0]], level)[:-1]


@lru_cache(maxsize=1)
def load_layout(package: Package) -> Layout:
    """Crop the head of the package's mesh by the hand-made picks and build its subdivision (0.3 s, kept)."""
    picks = hand_made("landmarks")
    base_ids = np.array(picks["crop"]["vertex_ids"], dtype=np.int64)
    face_ids = np.array(picks["crop"]["face_ids"], dtype=np.int64)
    row = {int(base): i for i, base in enumerate(base_ids)}
    arcs = {name: [row[v] for v in arc] for name, arc in picks["arcs"].items()}
    loops = {name: [row[v] for v in loop] for name, loop in picks["loops"].items()}
    outer, corners = loops["lip_outer"], _outer_corners(loops["lip_outer"], picks, row)
    arcs["lip_outer_upper"], arcs["lip_outer_lower"] = _split(outer, *corners)
    return Layout(
        base_ids=base_ids,
        skin=np.isin(face_ids, picks["crop"]["skin_only_face_ids"]),
        landmarks={name: row[v] for name, v in picks["landmarks"].items()},
        loops=loops,
        arcs=arcs,
        rings={k: [[row[v] for v in ring] for ring in rings] for k, rings in picks["rings"].items() if k != "note"},
        subdivision=catmull_clark(np.searchsorted(base_ids, package.quads[face_ids]), len(base_ids), LEVELS),
    )


def _outer_corners(loop: list[int], picks: dict[str, Any], row: dict[int, int]) -> tuple[int, int]:
    names = ("mouth_corner_outer_r", "mouth_corner_outer_l")
    right, left = (loop.index(row[picks["landmarks"][name]]) for name in names)
    return right, left


def _split(loop: list[int], start: int, end: int) -> tuple[list[int], list[int]]:
    """Split a loop in its way from start to end and the other way round, both from start to end."""
    turned = loop[start:] + loop[:start]
    cut = (end - start) % len(loop)
    return turned[: cut + 1], [turned[0], *turned[: cut - 1 : -1]]
