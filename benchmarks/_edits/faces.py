"""Made-up faces of any size, for the benchmarks of edits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.decomposition import Decomposer
from toolkit.details import Reconstruction
from toolkit.mesh import TriangleMesh
from toolkit.rigid import Similarity
from toolkit.stabilisation import HeadMotion

__all__ = ["bells", "made_up_face", "unplaced"]

Array = NDArray[np.float64]


def made_up_face(n_vertices: int) -> TriangleMesh:
    """A domed sheet of 16 by 20, gently waved."""
    n = max(round(np.sqrt(n_vertices)), 8)
    m = max(round(n_vertices / n), 8)
    i, j = np.meshgrid(np.arange(n - 1), np.arange(m - 1), indexing="ij")
    a = (i * m + j).ravel()
    b, c, d = a + m, a + m + 1, a + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    u, v = (x.ravel() for x in np.meshgrid(np.linspace(-8, 8, n), np.linspace(-10, 10, m), indexing="ij"))
    dome = 8 * np.exp(-((u / 9) ** 2) - (v / 11) ** 2) + 0.1 * np.sin(2 * u) * np.cos(v)
    return TriangleMesh(np.column_stack([u, v, dome]), triangles)


def bells(rest: Array, n_bases: int, rng: np.random.Generator) -> Array:
    """Displacements (K, V, 3) that are bells at random places of the face."""
    moves = np.empty((n_bases, len(rest), 3))
    for k in range(n_bases):
        x, y, size = rng.uniform(-5, 5), rng.uniform(-7, 7), rng.uniform(1.5, 4)
        bell = np.exp(-((rest[:, 0] - x) ** 2 + (rest[:, 1] - y) ** 2) / size**2)
        moves[k] = bell[:, None] * rng.normal(0, 0.6, 3)
    return moves


def unplaced(target: Decomposer, bases: Array, weights: Array) -> Reconstruction:
    """What builds frames of a face whose head stays still, in the place and size of its bases."""
    motion, here = HeadMotion.none(len(weights)), Similarity(1.0, np.eye(3), np.zeros(3))
    return Reconstruction(target, bases, weights, np.ones(len(target.rest.smooth)), motion, here)
