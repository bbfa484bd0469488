from __future__ import annotations

import numpy as np
import pytest

from toolkit.mesh import TriangleMesh
from toolkit.rendering import Camera
from viewer.picking import Picker, pixels_from_ray
from viewer.state.cameras import Framing, Viewpoint, pixel_ray, pixel_size

SIZES = [(400, 300), (640, 720), (1201, 903)]


def head(n: int = 30, m: int = 44) -> TriangleMesh:
    """A closed, dented, uneven ball: it has a back, a nose that hides a part, and triangles of all sizes."""
    polar = np.linspace(0, np.pi, n)[1:-1] ** 1.15 * np.pi**-0.15
    turn = np.linspace(0, 2 * np.pi, m, endpoint=False)
    p, t = (a.ravel() for a in np.meshgrid(polar, turn, indexing="ij"))
    direction = np.stack([np.sin(p) * np.sin(t), np.cos(p), np.sin(p) * np.cos(t)], axis=1)
    nose = np.exp(-30 * ((direction - [0.05, -0.05, 1.0]) ** 2).sum(axis=1))
    dent = np.exp(-50 * ((direction - [0.35, 0.3, 0.88]) ** 2).sum(axis=1))
    points = direction * (1 + 0.5 * nose - 0.2 * dent)[:, None] * [0.8, 1.0, 0.9]
    rows = np.arange((n - 2) * m).reshape(n - 2, m)
    a, b = rows[:-1], np.roll(rows, -1, axis=1)[:-1]
    c, d = rows[1:], np.roll(rows, -1, axis=1)[1:]
    faces = [np.stack([a, c, d], -1), np.stack([a, d, b], -1)]
    top, bottom = len(points), len(points) + 1
    points = np.concatenate([points, [[0, 1.0, 0], [0, -1.0, 0]]])
    faces.append(np.stack([np.full(m, top), rows[0], np.roll(rows[0], -1)], -1)[None])
    faces.append(np.stack([np.full(m, bottom), np.roll(rows[-1], -1), rows[-1]], -1)[None])
    return TriangleMesh(points, np.concatenate([f.reshape(-1, 3) for f in faces]).astype(np.int32))


def lips() -> TriangleMesh:
    """Two sheets that overlap by a sliver: the upper lip hangs over the lower one."""
    x, y = np.meshgrid(np.linspace(-1, 1, 30), np.linspace(0, 1, 16), indexing="ij")
    upper = np.stack([x.ravel(), y.ravel() - 0.04, 0.1 + 0 * x.ravel()], axis=1)
    lower = np.stack([x.ravel() * 0.98 + 0.01, -y.ravel() * 0.98 + 0.03, 0 * x.ravel()], axis=1)
    ids = np.arange(x.size).reshape(x.shape)
    a, b, c, d = ids[:-1, :-1].ravel(), ids[1:, :-1].ravel(), ids[1:, 1:].ravel(), ids[:-1, 1:].ravel()
    one = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return TriangleMesh(np.concatenate([upper, lower]), np.concatenate([one, one[:, ::-1] + x.size]).astype(np.int32))


def first_hits(mesh: TriangleMesh, origin: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slow and obvious: every ray against every triangle (Moeller and Trumbore); distance and triangle."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    distance, triangle = np.full(len(directions), np.inf), np.full(len(directions), -1)
    for i, direction in enumerate(directions):
        cross = np.cross(direction, v)
        scale = np.einsum("fi,fi->f", u, cross)
        scale = np.where(np.abs(scale) < 1e-14, np.inf, scale)
        s = (origin - a) / scale[:, None]
        p, q = np.einsum("fi,fi->f", s, cross), np.cross(s, u)
        r, t = q @ direction, np.einsum("fi,fi->f", v, q)
        inside = (p >= -1e-9) & (r >= -1e-9) & (p + r <= 1 + 1e-9) & (t > 1e-6)
        if inside.any():
            t = np.where(inside, t, np.inf)
            distance[i], triangle[i] = t.min(), t.argmin()
    return distance, triangle


def views(mesh: TriangleMesh) -> list[Camera]:
    framing = Framing.of(mesh.vertices)
    return [Viewpoint().camera(framing), Viewpoint(28.0, 14.0, 2.6, (0.05, -0.03, 0.0)).camera(framing)]


@pytest.mark.parametrize("view", [0, 1])
@pytest.mark.parametrize("make", [head, lips])
def test_the_vertex_pointed_at_is_picked(make, view: int) -> None:
    mesh = make()
    picker, camera = Picker(mesh.vertices, mesh.triangles), views(mesh)[view]
    origin = np.asarray(camera.position)
    rays = mesh.vertices - origin
    reach = np.linalg.norm(rays, axis=1)
    seen = first_hits(mesh, origin, rays / reach[:, None])[0] >= reach * (1 - 1e-5)
    for size in SIZES:
        chosen = np.random.default_rng(view).choice(np.flatnonzero(seen), 200, replace=bool(seen.sum() < 200))
        screen = camera.project(mesh.vertices, size)
        pixels = np.floor(screen[chosen, :2]) + 0.5  # where a pointer can be
        apart = np.hypot(*(screen[None, :, :2] - pixels[:, None]).transpose(2, 0, 1))
        apart[:, ~seen] = np.inf
        directions = np.stack([pixel_ray(camera, *at, size)[1] for at in pixels])
        triangles = first_hits(mesh, origin, directions)[1]
        asked = 0
        for vertex, at, near, triangle in zip(chosen, pixels, apart, triangles, strict=True):
            hit = picker.pick(camera, *at, size)
            assert hit is not None
            assert seen[hit.vertex]
            if near[vertex] > near.min():
                continue
            # Behind an outline the ray meets what is in front; then a vertex of that is right.
            front = triangle >= 0 and not _joined(mesh, int(triangle), int(vertex), 3)
            asked += not front
            assert front or hit.vertex == vertex
        assert asked > 150


def _joined(mesh: TriangleMesh, triangle: int, vertex: int, rings: int) -> bool:
    known = set(mesh.triangles[triangle].tolist())
    for _ in range(rings):
        known |= set(mesh.triangles[np.isin(mesh.triangles, list(known)).any(axis=1)].ravel().tolist())
    return vertex in known


def test_the_other_lip_is_never_picked() -> None:
    mesh = lips()
    half = mesh.n_vertices // 2
    picker, camera, size = Picker(mesh.vertices, mesh.triangles), views(mesh)[0], (640, 480)
    for place in ([0.21, -0.035, 0.1], [0.013, -0.001, 0.1], [-0.4, 0.02, 0.1]):
        x, y, _ = camera.project(np.array([place]), size)[0]
        hit = picker.pick(camera, x, y, size)
        assert hit is not None
        assert hit.vertex < half
        np.testing.assert_allclose(hit.position, place, atol=0.01)


def test_hits_say_where_on_the_triangle() -> None:
    mesh = head()
    picker, camera, size = Picker(mesh.vertices, mesh.triangles), views(mesh)[1], (500, 500)
    hit = picker.pick(camera, 251.5, 240.5, size)
    assert hit is not None
    inside = np.asarray(hit.barycentric) @ mesh.vertices[mesh.triangles[hit.triangle]]
    np.testing.assert_allclose(inside, hit.position, atol=1e-6)
    back = camera.project(inside[None], size)[0]
    assert back[:2] == pytest.approx((251.5, 240.5), abs=0.01)
    assert picker.along(*pixel_ray(camera, 251.5, 240.5, size)).triangle == hit.triangle


def test_beside_the_face_nothing_is_picked_but_its_outline_has_some_width() -> None:
    mesh = head()
    picker, camera, size = Picker(mesh.vertices, mesh.triangles), views(mesh)[0], (500, 500)
    assert picker.pick(camera, 5.5, 5.5, size) is None
    flat = camera.project(mesh.vertices, size)
    edge = flat[:, 0].max()
    y = flat[flat[:, 0].argmax(), 1]
    assert picker.pick(camera, edge + 2.5, y, size) is not None
    assert picker.pick(camera, edge + 9.5, y, size) is None


def test_a_moved_face_is_picked_where_it_is() -> None:
    mesh = head()
    camera = views(mesh)[0]
    moved = Picker(mesh.vertices, mesh.triangles).moved(mesh.vertices + [0.3, 0.0, 0.0])
    hit = moved.pick(camera, 250.5, 250.5, (500, 500))
    assert hit is not None
    assert mesh.vertices[hit.vertex, 0] == pytest.approx(-0.3, abs=0.08)


def test_distance_from_the_pointer_in_pixels() -> None:
    camera, size = Camera((0, 0, 10), (0, 0, 0)), (400, 400)
    point = np.array([[0.3, -0.2, 1.0]])
    x, y, _ = camera.project(point, size)[0]
    origin, direction = pixel_ray(camera, x + 3, y + 4, size)
    assert pixels_from_ray(origin, direction, point, camera, 400)[0] == pytest.approx(5, rel=0.01)
    assert pixel_size(camera, point, 400)[0] == pytest.approx(9 * 2 * np.tan(np.radians(11)) / 400)
