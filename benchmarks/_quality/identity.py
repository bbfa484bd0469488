"""Section "identity": the source onto itself, and onto a turned, scaled and moved copy of itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks._quality.rows import Row, Section, at_most, measured
from benchmarks._quality.shots import Take, make_shot, run_with
from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.progress import Progress
from toolkit.rigid import Similarity
from toolkit.shot import Shot

__all__ = ["section"]

_COPY = Similarity(3.3, Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix(), np.array([10.0, -50.0, 3.0]))


def section(take: Take, lines: Path, folder: Path, progress: Progress) -> Section:
    """Run the whole pipeline onto both, at a basis threshold of zero and at the default."""
    mesh = take.mesh()
    rows: list[Row] = []
    for name, place, goal in (
        ("itself", Similarity(1.0, np.eye(3), np.zeros(3)), 1e-6),
        ("a turned, scaled, moved copy", _COPY, 1e-5),
    ):
        target = folder / "target.ply"
        write_mesh(target, TriangleMesh(place.apply(mesh.vertices), mesh.triangles))
        shot = make_shot(folder / "shot", take, target, lines)
        size = place.scale * mesh.diagonal
        shot = run_with(shot, progress, bases={"threshold": 0.0})
        largest, _ = _difference(shot, take, place)
        rows.append(at_most(f"{name}, threshold 0: largest", largest / size, goal, "of the box"))
        shot = run_with(shot, progress)
        largest, rms = _difference(shot, take, place)
        residual = place.scale * float(np.sqrt(np.mean(shot.array("bases", "frame_errors") ** 2)))
        rows += [
            measured(f"{name}, default threshold: largest", largest / size, "of the box"),
            measured(f"{name}, default threshold: RMS", rms / size, "of the box"),
            at_most(f"{name}: RMS over the bases' own residual", rms / max(residual, 1e-300), 1.1),
            measured(f"{name}: bases", len(shot.array("bases", "frames"))),
        ]
    about = (
        f"{len(take.weights)} frames, {mesh.n_vertices} vertices, wrinkles and head motion included, registration "
        "skipped (same topology), feature lines and contacts on."
    )
    return Section("identity", about, tuple(rows))


def _difference(shot: Shot, take: Take, place: Similarity) -> tuple[float, float]:
    """Largest and RMS distance of the result from the source, placed."""
    largest, squares = 0.0, []
    for result, frame in zip(shot.array("result", "frames"), take.sequence().read(0, len(take.weights)), strict=True):
        squared = np.sum((result - place.apply(frame)) ** 2, axis=1)
        largest = max(largest, float(squared.max()))
        squares.append(float(squared.mean()))
    return float(np.sqrt(largest)), float(np.sqrt(np.mean(squares)))
