from __future__ import annotations

from collections.abc import Callable

import numpy as np

from toolkit.detail_edit import Surface
from toolkit.detail_edit.bend import bent_along
from toolkit.detail_edit.flatten import FlatPatch, flattened, located, minimal_turn
from toolkit.detail_edit.region import Region


def _patch(points: np.ndarray, triangles: np.ndarray, centre: int, axes: np.ndarray, ids: np.ndarray) -> FlatPatch:
    surface = Surface(points, triangles)
    at = surface.at_vertex(centre)
    patch = flattened(surface, ids, surface.triangles[at.triangle], np.array(at.weights), axes)
    assert patch is not None
    return patch


def test_a_cylinder_unrolls_without_stretch(grid: Callable[[int, int], np.ndarray]) -> None:
    n, m = 61, 41
    angle, height = np.meshgrid(np.linspace(-1.4, 1.4, n), np.linspace(-1, 1, m), indexing="ij")
    points = np.stack([np.sin(angle), height, np.cos(angle)], -1).reshape(-1, 3)
    patch = _patch(points, grid(n, m), 30 * m + 20, np.eye(3), np.arange(n * m))
    assert np.abs(patch.places - (angle + 1j * height).ravel()).max() < 1e-3


def test_only_what_hangs_together_with_the_centre_is_laid_flat(flat: Surface) -> None:
    left = np.flatnonzero(np.abs(flat.vertices[:, 0]) > 0.3)
    centre = int(np.argmin(np.abs(flat.vertices - [0.7, 0, 0]).sum(axis=1)))
    patch = _patch(flat.vertices, flat.triangles, centre, np.eye(3), left)
    assert flat.vertices[patch.vertices, 0].min() > 0.25
    moved = flat.vertices[patch.vertices] - flat.vertices[centre]
    assert np.abs(patch.places - (moved[:, 0] + 1j * moved[:, 1])).max() < 1e-9


def test_places_are_found_in_the_plane_and_outside_is_told(flat: Surface) -> None:
    places = flat.vertices[:, 0] + 1j * flat.vertices[:, 1]
    rng = np.random.default_rng(2)
    queries = rng.uniform(-1.5, 1.5, 300) + 1j * rng.uniform(-1.5, 1.5, 300)
    triangle, weights = located(places, flat.triangles, queries)
    inside = (np.abs(queries.real) < 0.95) & (np.abs(queries.imag) < 1.15)
    outside = (np.abs(queries.real) > 1.01) | (np.abs(queries.imag) > 1.21)
    assert (triangle[inside] >= 0).all()
    assert (triangle[outside] < 0).all()
    found = (weights * places[flat.triangles[triangle]]).sum(axis=1)
    assert np.abs(found - queries)[inside].max() < 1e-9


def test_the_smallest_turn_takes_one_direction_to_the_other() -> None:
    rng = np.random.default_rng(8)
    start, goal = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.standard_normal((2, 20, 3)))
    turn = minimal_turn(start, goal)
    assert np.abs(np.einsum("nij,nj->ni", turn, start) - goal).max() < 1e-9
    assert np.abs(turn @ np.swapaxes(turn, 1, 2) - np.eye(3)).max() < 1e-9
    axis = np.cross(start, goal)
    assert np.abs(np.einsum("nij,nj->ni", turn, axis) - axis).max() < 1e-9


def test_a_bent_strip_keeps_its_width_and_does_not_fold(flat: Surface) -> None:
    """An arch bent into the opposite arch, far more than the strip is wide."""
    places = flat.vertices[:, 0] + 1j * flat.vertices[:, 1]
    patch = FlatPatch(np.arange(len(places)), flat.triangles, places)
    x = np.linspace(-0.6, 0.6, 40)
    curve, goal = x + 1j * (0.25 - 0.5 * x**2), x + 1j * (-0.5 + 0.5 * x**2)
    away = np.abs(places[:, None] - curve).min(axis=1)
    strip = Region.whole(np.flatnonzero(away < 0.15))
    bent = bent_along(patch, strip, curve, goal, 0.2)
    assert np.abs(bent[strip.vertices][:, None] - goal).min(axis=1).max() < 0.2
    used = flat.triangles[np.isin(flat.triangles, strip.vertices).all(axis=1)]
    a, b, c = (bent[used[:, k]] for k in range(3))
    before = ((places[used[:, 1]] - places[used[:, 0]]).conj() * (places[used[:, 2]] - places[used[:, 0]])).imag
    after = ((b - a).conj() * (c - a)).imag
    assert (after / before).min() > 0.5
    assert (after / before).max() < 2
