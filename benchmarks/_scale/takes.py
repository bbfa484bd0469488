"""The sample performance at any resolution and length, written in chunks: a take may be larger than memory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from data import ensure_samples
from data.samples import PerformerPaths
from data.subdivision import catmull_clark
from toolkit.errors import InputError
from toolkit.feature_lines import FeatureLine, load_feature_lines, trace_lines
from toolkit.mesh import TriangleMesh
from toolkit.meshio import read_mesh

__all__ = ["LEVELS", "PerformerAt", "performer_at", "split_longest_edges"]

LEVELS = (4_326, 17_259, 68_949)
_CHUNK_BYTES = 100 * 2**20


@dataclass(frozen=True)
class PerformerAt:
    """The performer with exactly the vertices asked for.

    ``mesh`` the neutral, cm; ``resample`` (V, n) from the sample's vertices to these; ``paths`` the sample's files.
    """

    mesh: TriangleMesh
    resample: sp.csr_matrix
    paths: PerformerPaths

    def lines(self) -> list[FeatureLine]:
        """The feature lines along this mesh's edges; the sample's vertices keep their ids."""
        return trace_lines(load_feature_lines(self.paths.feature_lines), self.mesh.vertices, self.mesh.triangles)

    def write_take(self, path: Path, n_frames: int) -> None:
        """Write ``(T, V, 3)`` float32: the sample's performance, wrinkles and head motion included, in so many frames.

        Frames between two of the sample's are interpolated.
        """
        sample = np.load(self.paths.frames, mmap_mode="r")
        places = np.linspace(0, len(sample) - 1, n_frames)
        shape = (n_frames, self.mesh.n_vertices, 3)
        take = np.lib.format.open_memmap(path, mode="w+", dtype=np.float32, shape=shape)
        size = max(1, _CHUNK_BYTES // (12 * self.mesh.n_vertices))
        for start in range(0, n_frames, size):
            at = places[start : start + size]
            first = np.minimum(at.astype(int), len(sample) - 2)
            share = (at - first).astype(np.float32)[:, None, None]
            frames = sample[first] + share * (sample[first + 1] - sample[first])
            columns = frames.transpose(1, 0, 2).reshape(frames.shape[1], -1)
            take[start : start + len(at)] = (self.resample @ columns).reshape(-1, len(at), 3).transpose(1, 0, 2)
        take.flush()


@lru_cache(maxsize=1)  # a large one takes a gigabyte
def performer_at(n_vertices: int) -> PerformerAt:
    """The performer with ``n_vertices``: the sample's level below, subdivided, then its longest edges split.

    From 275,000 vertices on the surface is Catmull-Clark's of the finest sample. The last one is kept.
    """
    if n_vertices < LEVELS[0]:
        raise InputError(f"the performer has at least {LEVELS[0]} vertices, not {n_vertices}", remedy="ask for more")
    level = max(k for k, count in enumerate(LEVELS) if count <= n_vertices)
    paths = ensure_samples(level=level, targets=()).performer
    mesh = read_mesh(paths.reference)
    triangles: NDArray[np.integer] = mesh.triangles
    resample = sp.identity(mesh.n_vertices, format="csr")
    if mesh.polygons is not None and 4 * mesh.n_vertices <= n_vertices:
        # A round makes four faces of one; vertices are as many as faces, but for the borders.
        rounds = int(np.log(n_vertices / mesh.n_vertices) / np.log(4))
        finer = catmull_clark(mesh.polygons.indices.reshape(-1, 4), mesh.n_vertices, rounds)
        quads = finer.quads[-1]
        triangles, resample = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), finer.matrix
    triangles, splits = split_longest_edges(resample @ mesh.vertices, triangles, n_vertices)
    resample = sp.csr_matrix(splits @ resample, dtype=np.float32)
    vertices = (resample @ mesh.vertices).astype(np.float64)
    return PerformerAt(TriangleMesh(vertices, np.ascontiguousarray(triangles, dtype=np.int32)), resample, paths)


def split_longest_edges(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer], n_vertices: int
) -> tuple[NDArray[np.integer], sp.csr_matrix]:
    """Put vertices in the middle of edges until there are ``n_vertices``: triangles ``(F', 3)``, matrix ``(V', V)``.

    Only edges that are the longest of all their triangles are split (Rivara 1984), longest first: none gets thin.
    """
    triangles = np.asarray(triangles, dtype=np.int64)
    matrix = sp.identity(len(vertices), format="csr")
    while matrix.shape[0] < n_vertices:
        points, n = matrix @ vertices, matrix.shape[0]
        sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2), axis=2)
        code, side_edge = np.unique(sides[..., 0] * n + sides[..., 1], return_inverse=True)
        side_edge, ends = side_edge.reshape(-1, 3), np.stack([code // n, code % n], axis=1)
        order = np.argsort(np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1), kind="stable")
        rank = np.empty(len(order), dtype=np.int64)
        rank[order] = np.arange(len(order))
        corner = np.argmax(rank[side_edge], axis=1)
        choice = side_edge[np.arange(len(triangles)), corner]
        terminal = np.bincount(choice, minlength=len(code)) == np.bincount(side_edge.ravel(), minlength=len(code))
        split = order[terminal[order]][::-1][: n_vertices - n]
        middle = np.full(len(code), -1)
        middle[split] = n + np.arange(len(split))
        rows = np.repeat(np.arange(len(split)), 2)
        halves = sp.csr_matrix((np.full(2 * len(split), 0.5), (rows, ends[split].ravel())), shape=(len(split), n))
        matrix = sp.vstack([matrix, halves @ matrix]).tocsr()
        cut = middle[choice] >= 0
        a, b, c = (triangles[cut][np.arange(cut.sum()), (corner[cut] + k) % 3] for k in range(3))
        m = middle[choice[cut]]
        triangles = np.concatenate([triangles[~cut], np.stack([a, m, c], 1), np.stack([m, b, c], 1)])
    return triangles, matrix
