"""The performer: one head, its 52 shapes, a scripted performance, relief and wrinkles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from data.files import write_json, write_obj, write_ply
from data.heads import PERFORMER, SHAPES, Head, build_head, eyeballs
from data.layout import load_layout
from data.package import Package
from data.performance import expression_weights, head_motion
from data.relief import static_relief
from data.remeshing import split_quads
from data.targets import feature_lines
from data.wrinkles import WrinkleFamily, wrinkle_families
from toolkit.feature_lines import save_feature_lines
from toolkit.progress import Progress, silent

__all__ = ["PERFORMER", "Performer", "build_performer", "load_performer"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Performer:
    """The performer at one level: ``frame(weights)`` is the stabilised skin with its relief.

    ``subdivide`` (V, 4326), ``quads`` (F, 4) all faces, ``skin`` (F', 3) the outer skin's triangles, ``relief``
    (V,) the static height along the normals in cm, ``families`` the wrinkles.
    """

    head: Head
    subdivide: sp.csr_matrix
    quads: NDArray[np.int64]
    skin: NDArray[np.int32]
    relief: Array
    families: list[WrinkleFamily]

    def smooth(self, weights: Array) -> Array:
        """Vertices ``(V, 3)`` of an expression without relief and wrinkles, cm."""
        return np.asarray(self.subdivide @ self.head.shape(weights))

    def frame(self, weights: Array) -> Array:
        """Vertices ``(V, 3)`` of an expression with relief and with the wrinkles that its compression brings out."""
        smooth = self.smooth(weights)
        height = self.relief.copy()
        for family in self.families:
            height[family.vertices] += family.height(smooth)
        return smooth + height[:, None] * self._skin_normals(smooth)

    def _skin_normals(self, vertices: Array) -> Array:
        """Unit normals ``(V, 3)`` where there is skin: one sparse product, a third of the general function's time."""
        a, b, c = (vertices[self.skin[:, k]] for k in range(3))
        (ux, uy, uz), (vx, vy, vz) = (b - a).T, (c - a).T
        normals = self._faces_at @ np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1)
        return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12))

    @cached_property
    def _faces_at(self) -> sp.csr_matrix:
        n_faces, n = len(self.skin), self.subdivide.shape[0]
        rows, columns = self.skin.ravel(), np.repeat(np.arange(n_faces), 3)
        return sp.csr_matrix((np.ones(3 * n_faces), (rows, columns)), shape=(n, n_faces))


def load_performer(package: Package, level: int) -> Performer:
    """Build the performer; the coarsest level shows no relief, its edges are longer than any wrinkle is wide."""
    layout, head = load_layout(package), build_head(package, PERFORMER)
    count = layout.subdivision.counts[level]
    subdivide = layout.subdivision.matrix[:count]
    rest = subdivide @ head.neutral
    relief, families = np.zeros(count), []
    skin = split_quads(layout.skin_quads(level))
    if level > 0:
        coarse = split_quads(layout.skin_quads(level - 1))
        families = wrinkle_families(rest, skin, coarse)
        relief = static_relief(layout, rest, skin, families, level)
    return Performer(head, subdivide, layout.quads(level), skin, relief, families)


def build_performer(package: Package, level: int, folder: Path, progress: Progress = silent) -> None:
    """Write the performer's files into ``folder``: reference.obj, frames.npy, weights.npy, shapes.npz and others."""
    layout, performer = load_layout(package), load_performer(package, level)
    weights = expression_weights()
    rest = performer.frame(np.zeros(len(SHAPES)))
    write_obj(folder / "reference.obj", rest.astype(np.float32), performer.quads)
    rotations, translations = _write_frames(folder / "frames.npy", performer, weights, progress)
    np.save(folder / "weights.npy", weights)
    np.savez(folder / "head_motion.npz", rotations=rotations, translations=translations)
    head = performer.head
    offsets = head.offsets.astype(np.float32)
    np.savez_compressed(folder / "shapes.npz", names=np.array(SHAPES), neutral=head.neutral, offsets=offsets)
    sp.save_npz(folder / "subdivision.npz", performer.subdivide)
    eyes, eye_triangles = eyeballs(package, head.eyes)
    write_ply(folder / "eyes.ply", eyes.astype(np.float32), eye_triangles)
    save_feature_lines(folder / "feature_lines.json", feature_lines(layout, level))
    write_json(folder / "landmarks.json", layout.landmarks)


def _write_frames(path: Path, performer: Performer, weights: Array, progress: Progress) -> tuple[Array, Array]:
    """Write the frames as they come, so that the take is never whole in memory; return the head's motion."""
    rotations, translations = head_motion(len(weights))
    shape = (len(weights), performer.subdivide.shape[0], 3)
    frames = np.lib.format.open_memmap(path, mode="w+", dtype=np.float32, shape=shape)
    for t, row in enumerate(weights):
        progress("building the performance", t, len(weights))
        frames[t] = performer.frame(row) @ rotations[t].T + translations[t]
    frames.flush()
    progress("building the performance", len(weights), len(weights))
    return rotations, translations
