from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolkit.checks.edges import edge_table
from toolkit.checks.winding import coherent_flips, enclosed_volumes


@pytest.mark.parametrize("seed", range(5))
def test_flips_undo_random_turning_up_to_the_smaller_side(head_with_eyes, seed):
    mesh = head_with_eyes
    rng = np.random.default_rng(seed)
    turned = rng.random(mesh.n_triangles) < rng.uniform(0.05, 0.45)
    triangles = np.where(turned[:, None], mesh.triangles[:, [0, 2, 1]], mesh.triangles)
    table = edge_table(triangles, mesh.n_vertices)
    flips, one_sided = coherent_flips(mesh.vertices, triangles, table)
    assert not one_sided.any()
    mended = np.where(flips[:, None], triangles[:, [0, 2, 1]], triangles)
    assert edge_table(mended, mesh.n_vertices).neighbour_faces()[2].all()
    # Within a part, either all turned faces are turned back or all others are turned too.
    parts = table.parts[triangles[:, 0]]
    for part in np.unique(parts):
        assert len(set((flips ^ turned)[parts == part])) == 1


def test_edge_table_agrees_with_counting(bump):
    table = edge_table(bump.triangles, bump.n_vertices)
    faces_of = {}
    for face, triangle in enumerate(bump.triangles.tolist()):
        for k in range(3):
            faces_of.setdefault(frozenset((triangle[k], triangle[(k + 1) % 3])), set()).add(face)
    assert len(table.edges) == len(faces_of)
    assert table.edges.tolist() == sorted(sorted(edge) for edge in faces_of)
    for row, edge in enumerate(table.edges.tolist()):
        assert set(table.faces_of(row).tolist()) == faces_of[frozenset(edge)]


def test_edge_table_knows_which_way_faces_run():
    """Two faces agree across 0-1, two run the same way along 1-2, and 0-2 is left by one and crowded by none."""
    table = edge_table(np.array([[0, 1, 2], [1, 0, 3], [1, 2, 4]]), 6)
    found = dict(zip(map(tuple, table.edges.tolist()), table.balance.tolist(), strict=True))
    assert found == {(0, 1): 0, (0, 2): -1, (0, 3): 1, (1, 2): 2, (1, 3): -1, (1, 4): -1, (2, 4): 1}
    assert len(set(table.parts[:5])) == 1
    assert table.parts[5] != table.parts[0]


def test_volume_of_a_ball_and_of_its_inverse(ball):
    table = edge_table(ball.triangles, ball.n_vertices)
    moved = ball.vertices + np.array([30.0, -20.0, 5.0])
    (volume,), (area,) = enclosed_volumes(moved, ball.triangles, table)
    corners = ball.vertices[ball.triangles]
    assert volume == pytest.approx(np.linalg.det(corners).sum() / 6, rel=1e-9)
    assert 0.9 * 4 * np.pi < area < 4 * np.pi
    inverse = replace(ball, triangles=ball.triangles[:, ::-1])
    (other,), _ = enclosed_volumes(moved, inverse.triangles, edge_table(inverse.triangles, inverse.n_vertices))
    assert other == pytest.approx(-volume)


def test_an_open_neck_is_closed_by_a_fan(head, ball):
    (volume,), _ = enclosed_volumes(head.vertices, head.triangles, edge_table(head.triangles, head.n_vertices))
    (whole,), _ = enclosed_volumes(ball.vertices, ball.triangles, edge_table(ball.triangles, ball.n_vertices))
    # The border is at z = -1/2; the cap below it is pi h^2 (3 - h) / 3 with h = 1/2.
    assert volume == pytest.approx((1 - 0.15625) * whole, rel=0.01)
