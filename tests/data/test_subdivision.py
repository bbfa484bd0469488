from __future__ import annotations

import itertools

import numpy as np

from data.subdivision import catmull_clark

CUBE = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
CORNERS = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))], dtype=float)


def test_a_cube_goes_where_catmull_and_clark_say():
    once = catmull_clark(CUBE, 8, 1)
    points = once.matrix @ CORNERS
    assert once.counts == (8, 8 + 12 + 6)
    # Corner (F + 2R + (3 - 3)P) / 3 with the mean face point F = (1, 1, 1) / 3 and edge midpoint R = (2, 2, 2) / 3.
    np.testing.assert_allclose(points[:8], CORNERS * 5 / 9)
    assert np.allclose(np.sort(np.abs(points[8:20]), axis=1), [0, 0.75, 0.75])
    assert np.allclose(np.sort(np.abs(points[20:]), axis=1), [0, 0, 1])


def test_every_level_reproduces_affine_maps_and_keeps_orientation():
    grid = np.arange(12).reshape(3, 4)
    quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2).reshape(-1, 4)
    flat = np.stack([*np.meshgrid(np.arange(4.0), np.arange(3.0)), np.zeros((3, 4))], axis=2).reshape(-1, 3)
    made = catmull_clark(quads, 12, 2)
    np.testing.assert_allclose(np.asarray(made.matrix.sum(1)).ravel(), 1)
    points = made.matrix @ flat
    a, b, c, d = (points[made.quads[2][:, k]] for k in range(4))
    assert (np.cross(c - a, d - b)[:, 2] > 0).all()


def test_a_refined_path_is_an_edge_path():
    made = catmull_clark(CUBE, 8, 2)
    path = made.refine_path([0, 1, 5], 2)
    quads = made.quads[2]
    edges = {frozenset(edge) for quad in quads.tolist() for edge in zip(quad, quad[1:] + quad[:1], strict=True)}
    assert len(path) == 9
    assert path[::4] == [0, 1, 5]
    assert all(frozenset(pair) in edges for pair in itertools.pairwise(path))
