"""A small performance on a ball of quads and triangles: its outside is known, and its frames are not all spanned."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolkit.export import Performance
from toolkit.mesh import Polygons

N_FRAMES, N_BASES = 11, 3


def ball(rings=6, segments=8):
    """Vertices (V, 3) of a unit ball and its polygons, counter-clockwise seen from outside; the last vertex is lone."""
    polar, around = np.linspace(0, np.pi, rings + 1)[1:-1], np.linspace(0, 2 * np.pi, segments, endpoint=False)
    p, a = np.meshgrid(polar, around, indexing="ij")
    ring_points = np.stack([np.sin(p) * np.cos(a), np.cos(p), -np.sin(p) * np.sin(a)], axis=2).reshape(-1, 3)
    vertices = np.concatenate([[[0, 1, 0]], ring_points, [[0, -1, 0]], [[0, 0, 0]]])
    faces, south = [], len(vertices) - 2
    for s in range(segments):
        t = (s + 1) % segments
        faces.append((0, 1 + s, 1 + t))
        for r in range(rings - 2):
            upper, lower = 1 + r * segments, 1 + (r + 1) * segments
            faces.append((upper + t, upper + s, lower + s, lower + t))
        last = 1 + (rings - 2) * segments
        faces.append((south, last + t, last + s))
    counts = np.array([len(f) for f in faces], dtype=np.int32)
    return vertices, Polygons(counts, np.concatenate(faces).astype(np.int32))


def make_performance(*, residual=0.01, triangles_only=False, still_head=False, n_frames=N_FRAMES, n_bases=N_BASES):
    rng = np.random.default_rng(7)
    vertices, polygons = ball()
    rest = 9.0 * vertices + [1, 2, 3]
    morphs = rest + rng.normal(scale=0.5, size=(n_bases, *rest.shape))
    weights = np.abs(rng.normal(size=(n_frames, n_bases)))
    turns = np.linspace(-1, 1, n_frames)[:, None] * [0.4, 2.5, 0.2]
    rotations = Rotation.from_rotvec(turns * (not still_head)).as_matrix()
    translations = rng.normal(size=(n_frames, 3)) * (not still_head)
    shapes = rest + np.einsum("tk,kvc->tvc", weights, morphs - rest)
    shapes += rng.normal(scale=residual, size=shapes.shape) if residual else 0
    exact = (np.einsum("tij,tvj->tvi", rotations, shapes) + translations[:, None]).astype(np.float32)
    return Performance(
        triangles=polygons.triangulate(),
        polygons=None if triangles_only else polygons,
        rest=rest,
        morphs=morphs,
        weights=weights,
        rotations=rotations,
        translations=translations,
        read=lambda start, stop: exact[start:stop],
        n_frames=n_frames,
        fps=29.97,
        name="anna's face 2",
    )


@pytest.fixture
def performance(monkeypatch):
    monkeypatch.setattr("toolkit.meshio.sequence._BLOCK_BYTES", 4 * 12 * len(ball()[0]))  # blocks of 4 frames
    return make_performance()


@pytest.fixture
def make():
    return make_performance
