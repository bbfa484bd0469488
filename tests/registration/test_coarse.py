"""Decimation keeps the way back up, and does not join sheets that touch."""

from __future__ import annotations

import numpy as np

from toolkit.mesh import TriangleMesh
from toolkit.registration.coarse import decimate


def test_prolongation_gives_the_fine_mesh_back_nearly(pair) -> None:
    mesh = pair.source.mesh
    coarse = decimate(mesh, 900)
    assert coarse.mesh.n_vertices < 1100
    np.testing.assert_allclose(coarse.prolong.sum(axis=1), 1, atol=1e-12)
    assert coarse.prolong.data.min() >= 0
    gaps = np.linalg.norm(coarse.prolong @ coarse.mesh.vertices - mesh.vertices, axis=1)
    assert np.percentile(gaps, 95) < 0.01 * mesh.diagonal


def test_touching_sheets_stay_apart(bump: TriangleMesh) -> None:
    n = bump.n_vertices
    two = TriangleMesh(
        np.concatenate([bump.vertices, bump.vertices + [0, 0, 1e-5]]),
        np.concatenate([bump.triangles, bump.triangles + n]).astype(np.int32),
    )
    coarse = decimate(two, 300)
    side = coarse.prolong @ np.ones(coarse.mesh.n_vertices)
    assert side.min() > 0
    # Which coarse vertices the first sheet uses, and which the second: none is shared.
    used = [set(coarse.prolong[rows].indices[coarse.prolong[rows].data > 0]) for rows in (slice(0, n), slice(n, 2 * n))]
    assert not used[0] & used[1]


def test_a_small_mesh_is_left_alone(bump: TriangleMesh) -> None:
    coarse = decimate(bump, 10_000)
    assert coarse.mesh is bump
    np.testing.assert_array_equal(coarse.prolong @ bump.vertices, bump.vertices)
