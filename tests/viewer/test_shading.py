from __future__ import annotations

import numpy as np
import pytest

from toolkit.mesh import TriangleMesh, vertex_normals
from toolkit.rendering import Camera
from viewer import shading
from viewer.shading import Light

FRONT = Camera((0.0, 0.0, 10.0), (0.0, 0.0, 0.0))


def lit(mesh: TriangleMesh, light: Light, camera: Camera = FRONT, base: np.ndarray | None = None) -> np.ndarray:
    vertices = mesh.vertices.astype(np.float32)
    normals, out = np.empty_like(vertices), np.empty_like(vertices)
    color = np.array([shading.SKIN], np.float32) if base is None else base
    shading.bake(vertices, mesh.triangles, color, light, camera, normals, out)
    np.testing.assert_allclose(normals, vertex_normals(mesh.vertices, mesh.triangles), atol=2e-4)
    return out


def test_normals_and_range(bump: TriangleMesh) -> None:
    out = lit(bump, Light())
    assert out.min() >= 0
    assert out.max() <= 1
    assert np.ptp(out[:, 0]) > 0.1


def test_the_light_comes_from_where_it_is_turned_to(bump: TriangleMesh) -> None:
    slope = vertex_normals(bump.vertices, bump.triangles)[:, 0]
    right = lit(bump, Light(azimuth=60.0, elevation=0.0))[:, 0]
    left = lit(bump, Light(azimuth=-60.0, elevation=0.0))[:, 0]
    assert np.corrcoef(slope, right)[0, 1] > 0.7
    assert np.corrcoef(slope, left)[0, 1] < -0.7


def test_the_light_travels_with_the_camera(bump: TriangleMesh) -> None:
    turned = bump.with_vertices(bump.vertices[:, [2, 1, 0]] * [1, 1, -1])  # a quarter turn about y
    camera = Camera((10.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    np.testing.assert_allclose(lit(turned, Light(), camera), lit(bump, Light()), atol=2e-3)


def test_the_back_is_dim_and_colours_are_kept(bump: TriangleMesh) -> None:
    behind = Camera((0.0, 0.0, -10.0), (0.0, 0.0, 0.0))
    assert lit(bump, Light(), behind).mean() < 0.7 * lit(bump, Light()).mean()
    base = np.zeros((bump.n_vertices, 3), np.float32)
    base[::2] = [0.0, 0.8, 0.0]
    out = lit(bump, Light(), base=base)
    assert (out[::2, 1] > out[::2, 0] + 0.05).all()


def test_a_lone_vertex_does_no_harm() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], float)
    mesh = TriangleMesh(points, np.array([[0, 1, 2]], np.int32))
    assert np.isfinite(lit(mesh, Light())).all()
    assert pytest.approx(1.0) == np.linalg.norm(shading.directions(Light(), FRONT), axis=1)
