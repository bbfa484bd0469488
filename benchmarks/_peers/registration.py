"""Registration beside trimesh's: the same two faces, the same landmarks, the known correspondence."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks._peers.comparison import Comparison, run_limited, timed
from benchmarks._scale.takes import LEVELS, performer_at
from data import ensure_samples
from data.targets import Truth
from toolkit.errors import MissingDependencyError
from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh
from toolkit.meshio import read_mesh
from toolkit.registration import Landmarks, register
from toolkit.registration.coarse import decimate
from toolkit.registration.curves import loops_of, source_rims
from toolkit.registration.interior import behind_loops
from toolkit.registration.surface import Surface

__all__ = ["compare_registration"]

Array = NDArray[np.float64]
PEERS = ("nricp_amberg", "nricp_sumner")


@dataclass(frozen=True)
class Pair:
    """Two faces; ``truth`` (V, 3) where the source's vertices belong, ``judged`` (V,) those on the face's skin."""

    source: TriangleMesh
    target: TriangleMesh
    truth: Array
    judged: NDArray[np.bool_]
    marks: Landmarks
    lines: list[FeatureLine]
    height: float

    def error(self, vertices: Array) -> float:
        """Mean distance to the true place over the face's skin, in percent of the face's height."""
        distance = np.linalg.norm(vertices - self.truth, axis=1)[self.judged]
        return float(100 * distance.mean() / self.height)


def compare_registration(name: str, n_vertices: int, peers: list[str], limit: float) -> list[Comparison]:
    """Both of trimesh's methods with ``n_vertices`` on the source; one that takes over ``limit`` seconds is stopped.

    The target keeps its own triangles, as a scan would: 12,506 vertices, or those of the finest sample.

    The peers begin from the landmarks' similarity, which is not counted.
    """
    if importlib.util.find_spec("rtree") is None:
        raise MissingDependencyError("trimesh's registration needs rtree", remedy="pip install rtree")
    pair = _pair(name, n_vertices)
    small = _pair(name, LEVELS[0]) if n_vertices > LEVELS[0] else pair
    register(small.source, small.target, small.marks, small.lines)  # compiled
    found, ours_s = timed(lambda: register(pair.source, pair.target, pair.marks, pair.lines))
    arrays = (pair.source.vertices, pair.source.triangles, pair.target.vertices, pair.target.triangles)
    rows = []
    for peer in peers:
        vertices, peer_s = run_limited(_trimesh, (peer, *arrays, pair.marks.source, pair.marks.target), limit)
        off = float("nan") if vertices is None else pair.error(vertices)
        size, unit = f"{pair.source.n_vertices:,}", "mean error, % of the face"
        rows.append(
            Comparison(
                f"{peer}_{n_vertices}", size, ours_s, peer_s, pair.error(found.vertices), off, unit, vertices is None
            )
        )
    return rows


def _trimesh(
    peer: str, source: Array, triangles: NDArray, target: Array, target_triangles: NDArray, picks: NDArray, on: NDArray
) -> Array:
    """Trimesh's registration with its own defaults, as its user would call it."""
    import trimesh

    matrix, _, _ = trimesh.registration.procrustes(source[picks], target[on], reflection=False)
    moving = trimesh.Trimesh(trimesh.transform_points(source, matrix), triangles, process=False)
    fixed = trimesh.Trimesh(target, target_triangles, process=False)
    method = getattr(trimesh.registration, peer)
    return np.asarray(method(moving, fixed, source_landmarks=picks, target_positions=target[on]))


def _pair(name: str, n_vertices: int) -> Pair:
    performer = performer_at(max(n_vertices, LEVELS[0]))
    own = max(k for k, count in enumerate(LEVELS) if count <= max(n_vertices, LEVELS[0]))
    level = 1 if n_vertices <= LEVELS[1] else 2
    truth_file = ensure_samples(level=own, targets=(name,)).targets[name].truth
    files = ensure_samples(level=level, targets=(name,)).targets[name]
    at_rest = Truth.load(truth_file, performer.paths.subdivision).shape(np.zeros(52))
    truth, lines, mesh = performer.resample @ at_rest, performer.lines(), performer.mesh
    lines = [FeatureLine(line.name, line.closed, line.vertices) for line in lines]
    names = json.loads(Path(performer.paths.landmarks).read_text(encoding="utf-8"))
    judged = _skin(mesh, lines, names)
    target = read_mesh(files.reference)
    picks = np.array([pair["source"] for pair in json.loads(files.landmarks_30.read_text(encoding="utf-8"))["pairs"]])
    height = float(np.linalg.norm(truth[names["forehead_high"]] - truth[names["menton"]]))
    if n_vertices < mesh.n_vertices:
        fewer = decimate(mesh, n_vertices).mesh
        hits = Surface(mesh).closest(fewer.vertices)
        corners = mesh.triangles[hits.triangles]
        picks = cKDTree(fewer.vertices).query(mesh.vertices[picks])[1]
        truth = np.einsum("nk,nkd->nd", hits.weights, truth[corners])
        # Lines do not survive the decimation.
        mesh, judged, lines = TriangleMesh(hits.points, fewer.triangles), np.all(judged[corners], axis=1), []
    # Decimation may bring two picks to one vertex.
    picks = np.unique(picks)
    on_target, kept = np.unique(cKDTree(target.vertices).query(truth[picks])[1], return_index=True)
    picks = picks[kept]
    marks = Landmarks.of(picks, on_target, [f"landmark {k}" for k in range(len(picks))])
    return Pair(mesh, target, truth, judged, marks, lines, height)


def _skin(mesh: TriangleMesh, lines: list[FeatureLine], names: dict[str, int]) -> NDArray[np.bool_]:
    """In front of the ears and between chin and hairline, without what lies behind lips and lids."""
    at = {key: mesh.vertices[vertex] for key, vertex in names.items()}
    front = mesh.vertices[:, 2] > max(at["tragus_l"][2], at["tragus_r"][2])
    between = (mesh.vertices[:, 1] > at["menton"][1]) & (mesh.vertices[:, 1] < at["forehead_high"][1])
    return front & between & ~behind_loops(mesh, loops_of(source_rims(lines, mesh)))
