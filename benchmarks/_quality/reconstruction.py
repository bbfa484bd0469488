"""Section "reconstruction": nothing is lost when a frame is taken apart and put together again."""

from __future__ import annotations

import numpy as np

from benchmarks._quality.rows import Row, Section, at_most
from benchmarks._quality.shots import Take
from toolkit.decomposition import Decomposer, coating, reconstruct_from_coating
from toolkit.mesh import TriangleMesh, connected_components
from toolkit.progress import Progress
from toolkit.smoothing import SmoothingParameters, smooth_with_pymeshlab

__all__ = ["section"]


def section(take: Take, frames: list[int], progress: Progress) -> Section:
    """Coating and back, and the batched filter beside pymeshlab's, on the performer."""
    mesh = take.mesh()
    decomposer = Decomposer(mesh)
    sequence = take.sequence()
    shapes = {"rest": mesh.vertices} | {f"frame {t}": sequence.read(t, t + 1)[0].astype(np.float64) for t in frames}
    rows: list[Row] = []
    for k, (name, vertices) in enumerate(shapes.items()):
        progress("taking frames apart", k, len(shapes))
        rows += _one(name, mesh.with_vertices(vertices), decomposer)
    progress("taking frames apart", len(shapes), len(shapes))
    about = f"{mesh.n_vertices} vertices; largest difference over all vertices as a share of the bounding box."
    return Section("reconstruction", about, tuple(rows))


def _one(name: str, mesh: TriangleMesh, decomposer: Decomposer) -> list[Row]:
    smooth = np.asarray(decomposer.filter.smooth(mesh.vertices), dtype=np.float64)
    detail = mesh.vertices - smooth
    count, labels = connected_components(mesh.triangles, mesh.n_vertices)
    gauge = np.stack([detail[labels == part].mean(axis=0) for part in range(count)])
    rebuilt = reconstruct_from_coating(smooth, coating(mesh.vertices, smooth, mesh.triangles), mesh.triangles, gauge)
    theirs = smooth_with_pymeshlab(mesh, SmoothingParameters())
    return [
        at_most(f"{name}: S~ + L^+ xi and the source", _share(rebuilt - mesh.vertices, mesh), 1e-9),
        at_most(f"{name}: smoothing and pymeshlab's", _share(smooth - theirs, mesh), 1e-6),
    ]


def _share(difference: np.ndarray, mesh: TriangleMesh) -> float:
    return float(np.linalg.norm(difference, axis=1).max()) / mesh.diagonal
