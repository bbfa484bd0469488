from __future__ import annotations

import numpy as np
import pytest

from toolkit.mesh import TriangleMesh
from viewer.raycast import first_hits, triangles_of_vertices


def slow_hits(mesh: TriangleMesh, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Distance along each ray, by solving for the point in every triangle's plane."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    distance = np.full(len(directions), np.inf)
    for i, direction in enumerate(directions):
        system = np.stack([b - a, c - a, np.broadcast_to(-direction, a.shape)], axis=2)
        u, v, t = np.linalg.solve(system, (origin - a)[..., None])[..., 0].T
        met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        distance[i] = t[met].min(initial=np.inf)
    return distance


@pytest.fixture
def rays(bump: TriangleMesh) -> np.ndarray:
    ends = np.random.default_rng(0).uniform([-1.6, -1.6, -0.1], [1.6, 1.6, 0.5], (300, 3)) - [0.3, 0.2, 6.0]
    return ends / np.linalg.norm(ends, axis=1, keepdims=True)


@pytest.mark.parametrize("origin", [(0.3, 0.2, 6.0), (0.02, -0.3, 0.75)])
def test_rays_meet_what_they_should(bump: TriangleMesh, rays: np.ndarray, origin: tuple[float, ...]) -> None:
    """From afar, and from so near that a part of the mesh is behind the eye."""
    vertices, start = bump.vertices.astype(np.float32), np.array(origin)
    mesh = bump.with_vertices(vertices.astype(float))
    ids, weights, distance = first_hits(vertices, bump.triangles, start, rays, np.array([0.1, 0.0, -1.0]))
    wanted = slow_hits(mesh, start, rays)
    met = np.isfinite(wanted)
    assert met.sum() > 50
    assert (ids[met] >= 0).all()
    np.testing.assert_allclose(distance[met], wanted[met], rtol=1e-6)
    assert (ids[~met] >= 0).sum() <= 2  # the rim itself counts as met
    places = np.einsum("nk,nkd->nd", weights[met], mesh.vertices[bump.triangles[ids[met]]])
    np.testing.assert_allclose(places, start + distance[met, None] * rays[met], atol=1e-6)


def test_rays_through_edges_and_corners_do_not_slip_between_triangles(bump: TriangleMesh) -> None:
    vertices, origin = bump.vertices.astype(np.float32), np.array([0.0, 0.0, 20.0])
    inside = np.flatnonzero(np.abs(bump.vertices[:, :2]).max(axis=1) < 0.9)
    middles = 0.5 * (vertices[bump.triangles[:, 0]] + vertices[bump.triangles[:, 1]])
    middles = middles[np.abs(middles[:, :2]).max(axis=1) < 0.9]
    ends = np.concatenate([vertices[inside], middles]).astype(float) - origin
    reach = np.linalg.norm(ends, axis=1)
    ids, _, distance = first_hits(vertices, bump.triangles, origin, ends / reach[:, None], np.array([0.0, 0.0, -1.0]))
    assert (ids >= 0).all()
    assert (distance <= reach * (1 + 1e-6)).all()


def test_what_lies_behind_is_not_met(bump: TriangleMesh) -> None:
    vertices = bump.vertices.astype(np.float32)
    ray, away = np.array([[0.0, 0.0, -1.0]]), np.array([0.0, 0.0, 1.0])
    assert first_hits(vertices, bump.triangles, np.array([0.0, 0.0, -9.0]), ray, ray[0])[0][0] == -1
    assert first_hits(vertices, bump.triangles, np.array([0.0, 0.0, 9.0]), ray, away)[0][0] == -1
    ids, weights, distance = first_hits(vertices, bump.triangles, np.zeros(3), np.zeros((0, 3)), away)
    assert (ids.shape, weights.shape, distance.shape) == ((0,), (0, 3), (0,))


def test_triangles_round_vertices(bump: TriangleMesh) -> None:
    starts, members = triangles_of_vertices(bump.triangles, bump.n_vertices)
    for vertex in (0, 17, 400, bump.n_vertices - 1):
        around = np.flatnonzero((bump.triangles == vertex).any(axis=1))
        np.testing.assert_array_equal(members[starts[vertex] : starts[vertex + 1]], around)
