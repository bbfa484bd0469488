from __future__ import annotations

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.rendering import Camera, Lighting, Lines, Markers, Renderer, kernels
from toolkit.rendering.shading import encode_pixels, encode_srgb, linear_rgb

SIZE = (200, 240)
BLACK = Lighting(background_top=(0, 0, 0), background_bottom=(0, 0, 0))


@pytest.fixture(scope="module")
def camera():
    return Camera((0, 0, 8), (0, 0, 0), fov=20)


def test_silhouette_of_a_sphere_has_the_radius_of_its_tangent_cone(sphere, camera):
    image = Renderer(sphere[1], lighting=BLACK).render(sphere[0], camera, SIZE, colors=np.ones_like(sphere[0]))
    covered = image.max(axis=2) > 0
    expected = SIZE[1] / 2 / np.tan(np.radians(10)) * np.tan(np.arcsin(1 / 8))
    assert np.ptp(np.nonzero(covered.any(axis=0))[0]) + 1 == pytest.approx(2 * expected, abs=2)
    assert np.ptp(np.nonzero(covered.any(axis=1))[0]) + 1 == pytest.approx(2 * expected, abs=2)
    assert covered.sum() == pytest.approx(np.pi * expected**2, rel=0.02)


def test_what_is_seen_equals_ray_casting(sphere):
    o3d = pytest.importorskip("open3d")
    rng = np.random.default_rng(0)
    vertices = sphere[0] * (1 + 0.3 * rng.random((len(sphere[0]), 1)))  # a spiky ball: much hides much
    camera, (w, h) = Camera.facing(vertices, (0.3, 0.5, 1)), (160, 200)
    screen = camera.project(vertices, (w, h))
    screen[:, 2] = 1 / screen[:, 2]
    _, face = kernels.rasterize(screen, sphere[1], w, h)
    right, up, toward = camera.axes()
    rotation = np.stack([right, -up, -toward])
    extrinsic = np.eye(4)
    extrinsic[:3, :3], extrinsic[:3, 3] = rotation, -rotation @ camera.position
    focal = h / 2 / np.tan(np.radians(camera.fov) / 2)
    intrinsic = np.array([[focal, 0, w / 2], [0, focal, h / 2], [0, 0, 1.0]])
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(vertices.astype(np.float32), sphere[1].astype(np.uint32))
    rays = scene.create_rays_pinhole(intrinsic, extrinsic, w, h)
    ids = scene.cast_rays(rays)["primitive_ids"].numpy().astype(np.int64)
    ids[ids == scene.INVALID_ID] = -1
    assert (face >= 0).mean() > 0.3
    assert (face == ids).mean() > 0.998  # samples on an edge may fall either way


def test_normals_point_out_and_have_unit_length(sphere):
    normals = kernels.smooth_normals(*sphere)
    assert normals == pytest.approx(sphere[0], abs=0.01)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(len(normals)))


def test_the_lit_side_is_bright_and_the_far_side_dark(sphere, camera):
    image = Renderer(sphere[1]).render(sphere[0], camera, SIZE).mean(axis=2)
    toward_key, away = image[95, 80], image[150, 130]  # the key comes from the upper left
    assert toward_key > 1.5 * away
    assert away > 1.5 * image[2, 2]


def test_turned_inside_out_it_is_darker(sphere, camera):
    right = Renderer(sphere[1]).render(sphere[0], camera, SIZE)
    flipped = Renderer(sphere[1][:, ::-1]).render(sphere[0], camera, SIZE)
    assert flipped[100, 90].mean() < 0.8 * right[100, 90].mean()


def test_colours_pass_unchanged_without_shading(sphere, camera):
    color = np.array([200, 31, 96], dtype=np.uint8)
    image = Renderer(sphere[1]).render(
        sphere[0], camera, SIZE, colors=np.tile(color, (len(sphere[0]), 1)), shading="none"
    )
    assert (image[110:130, 90:110] == color).all()


def test_colours_are_interpolated_in_perspective():
    # A quad that recedes: its middle in space is not its middle on the screen.
    vertices = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, -20], [-1, 1, -20]])
    renderer = Renderer([[0, 1, 2], [0, 2, 3]], lighting=BLACK)
    camera = Camera((0, 5, 6), (0, 0, -8), fov=40)
    shade = linear_rgb(np.array([0.2, 0.2, 0.9, 0.9]))
    colors = encode_srgb(np.repeat(shade[:, None], 3, axis=1))
    image = renderer.render(vertices, camera, SIZE, colors=colors, shading="none")
    x, y, _ = camera.project([[0, 0, -10]], SIZE)[0]
    expected = 255 * encode_srgb(shade.mean())
    assert image[int(y), int(x), 0] == pytest.approx(expected, abs=4)


def test_the_key_light_casts_a_shadow():
    ground = np.array([[-4.0, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]])
    screen = np.array([[-1.5, 0.5, 1], [-0.5, 0.5, 1], [-0.5, 1.5, 1], [-1.5, 1.5, 1]])
    vertices, quad = np.concatenate([ground, screen]), np.array([[0, 1, 2], [0, 2, 3]])
    lighting = Lighting(key=(-1, 1, 1), occlusion=False)
    camera = Camera((0, 0, 40), (0, 0, 0), fov=12)
    shadowed = Renderer(np.concatenate([quad, quad + 4]), lighting=lighting).render(vertices, camera, SIZE)
    plain = Renderer(quad, lighting=lighting).render(vertices, camera, SIZE)
    x, y, _ = camera.project([[0, 0, 0]], SIZE)[0].astype(int)  # behind the little screen, seen along the light
    assert shadowed[y, x].mean() < 0.7 * plain[y, x].mean()
    assert shadowed[y + 30, x + 40].mean() == pytest.approx(plain[y + 30, x + 40].mean(), abs=3)


def test_hollows_receive_less_sky():
    # A deep box, open towards us: its floor sees little of the sky.
    import trimesh

    n = 24
    x, y = np.meshgrid(np.linspace(-2, 2, n), np.linspace(-2, 2, n))
    z = np.where((abs(x) < 0.7) & (abs(y) < 0.7), -3.0, 0.0)
    grid = np.arange(n * n).reshape(n, n)
    a, b, c, d = (g.ravel() for g in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]))
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    vertices = trimesh.Trimesh(np.stack([x, y, z], -1).reshape(-1, 3), triangles, process=False).vertices
    sky_only = Lighting(key_strength=1e-9, fill_strength=0, rim_strength=0, sky_strength=1, shadows=False)
    image = Renderer(triangles, lighting=sky_only).render(vertices, Camera((0, 0, 20), (0, 0, 0), fov=14), SIZE)
    assert image[120, 100].mean() < 0.85 * image[40, 30].mean()


def test_markers_and_lines_are_hidden_by_the_surface(sphere, camera):
    front, back = int(np.argmax(sphere[0][:, 2])), int(np.argmin(sphere[0][:, 2]))
    renderer = Renderer(sphere[1])
    plain = renderer.render(sphere[0], camera, SIZE)
    mark = renderer.render(sphere[0], camera, SIZE, overlays=[Markers([front], (255, 0, 0))])
    assert tuple(mark[120, 100]) == (255, 0, 0)
    assert (mark != plain).any(axis=2).sum() < 80
    hidden = renderer.render(sphere[0], camera, SIZE, overlays=[Markers([back]), Lines([back, back])])
    assert (hidden == plain).all()


def test_wireframe_darkens_edges_only(sphere, camera):
    renderer = Renderer(sphere[1])
    plain = renderer.render(sphere[0], camera, SIZE).astype(int)
    wired = renderer.render(sphere[0], camera, SIZE, wireframe=1.0).astype(int)
    face = plain[80:160, 60:140].mean(axis=2)
    change = (face - wired[80:160, 60:140].mean(axis=2)) / face
    assert 0.1 < (change > 0.3).mean() < 0.9
    assert change.min() > -0.02


def test_what_is_behind_the_camera_is_not_drawn(sphere):
    camera = Camera((0, 0, 5), (0, 0, 10), fov=40)  # the sphere is behind
    image = Renderer(sphere[1], lighting=BLACK).render(sphere[0], camera, SIZE)
    assert image.max() == 0


def test_same_input_same_picture(sphere, camera):
    renderer = Renderer(sphere[1])
    first = renderer.render(sphere[0], camera, SIZE)
    assert (renderer.render(sphere[0].astype(np.float32).astype(float), camera, SIZE) != first).mean() < 0.01
    assert (renderer.render(sphere[0], camera, SIZE) == first).all()


def test_bad_input_is_named(sphere, camera):
    renderer = Renderer(sphere[1])
    with pytest.raises(InputError, match="need at least 2562 vertices"):
        renderer.render(sphere[0][:100], camera)
    broken = sphere[0].copy()
    broken[7, 1] = np.nan
    with pytest.raises(InputError, match="vertex 7 is not finite"):
        renderer.render(broken, camera)
    with pytest.raises(InputError, match="need colours of shape"):
        renderer.render(sphere[0], camera, colors=np.ones((3, 3)))
    with pytest.raises(InputError, match="no shading is called"):
        renderer.render(sphere[0], camera, shading="toon")
    with pytest.raises(InputError, match="triangles of shape"):
        Renderer(np.zeros((0, 3)))


def test_colours_survive_the_way_to_linear_light_and_back():
    every = np.arange(256, dtype=np.uint8)
    assert np.array_equal(encode_pixels(linear_rgb(every)), every)
    assert np.array_equal(encode_pixels(np.array([-1.0, 2.0])), [0, 255])
