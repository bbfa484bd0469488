"""What is behind the lips is found, with their line and without, and other components are not skin."""

from __future__ import annotations

import numpy as np

from toolkit.mesh import TriangleMesh
from toolkit.registration.interior import behind_loops, exposure, find_interior, minor_components


def test_a_loop_cuts_off_exactly_the_bag(pair) -> None:
    face = pair.source
    loop = np.concatenate([face.upper, face.lower[1:-1][::-1]])
    np.testing.assert_array_equal(behind_loops(face.mesh, [loop]), face.bag)


def test_no_loop_cuts_nothing(pair) -> None:
    assert not behind_loops(pair.source.mesh, []).any()


def test_without_a_loop_the_bag_is_found_by_its_darkness(pair) -> None:
    face = pair.source
    hidden = find_interior(face.mesh)
    assert hidden[face.bag].mean() > 0.9
    assert hidden[~face.bag].mean() < 0.02


def test_an_open_convex_patch_sees_the_whole_sky(bump: TriangleMesh) -> None:
    x, y = bump.vertices[:, :2].T
    cap = bump.with_vertices(np.column_stack([x, y, 1 - 0.3 * (x**2 + y**2)]))
    np.testing.assert_allclose(exposure(cap), 1, atol=1e-9)


def test_other_components_are_interior(pair, bump: TriangleMesh) -> None:
    face, n = pair.source.mesh, pair.source.mesh.n_vertices
    eye = bump.vertices * 0.1 + [0.4, 0.3, 0.2]
    both = TriangleMesh(
        np.concatenate([face.vertices, eye]), np.concatenate([face.triangles, bump.triangles + n]).astype(np.int32)
    )
    mask = minor_components(both)
    assert mask[n:].all()
    assert not mask[:n].any()
