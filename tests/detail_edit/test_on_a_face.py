"""Wrinkle edits on the skin of a head, with wrinkles of known shape."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from data.heads import build_head
from data.layout import LEVELS, hand_made, load_layout
from data.package import Package
from data.performer import PERFORMER
from data.remeshing import split_quads
from toolkit.decomposition import frame_neighbours
from toolkit.detail_edit import (
    Curve,
    DetailTake,
    Mirror,
    PasteEdit,
    ReshapeEdit,
    ScaleEdit,
    Surface,
    SurfacePoint,
    banded,
    drawn,
    snapped,
    solve_detail_edit,
    within,
)
from toolkit.detail_edit.flatten import minimal_turn
from toolkit.mesh import TriangleMesh
from toolkit.mesh.geometry import local_frames

KEY = 1
LINE = [(-5.0, 3.9), (-3.5, 4.35), (-1.8, 4.25)]


@pytest.fixture(scope="module")
def face(wheel: Path) -> DetailTake:
    """The sample performer's skin, 68,949 vertices, with two wrinkles on its forehead in the middle one of 3 frames."""
    package = Package(wheel)
    layout = load_layout(package)
    rest = layout.subdivision.matrix @ build_head(package, PERFORMER).neutral
    mesh = TriangleMesh(rest, split_quads(layout.quads(LEVELS)))
    neighbour = frame_neighbours(rest, mesh.triangles)
    frames0 = local_frames(rest, mesh.triangles, neighbour)
    nothing = np.zeros((3, len(rest), 3), dtype=np.float32)
    bare = DetailTake(mesh, rest, neighbour, frames0, nothing, np.ones(len(rest)), np.zeros_like(rest))
    height = np.zeros(len(rest))
    for points in (LINE, [(-4.5, 5.5), (-3.2, 5.9), (-1.6, 5.8)]):
        away = bare.surface.distance(drawn(bare.surface, [_point(bare, s, y) for s, y in points]), 2.0) / 0.25
        height -= 0.08 * np.where(np.isfinite(away), (1 - away**2) * np.exp(-(np.minimum(away, 9) ** 2) / 2), 0)
    details = nothing.copy()
    details[:, :, 2] = np.array([[0.1], [1.0], [0.1]]) * height
    return replace(bare, details=details)


def _point(face: DetailTake, along: float, up: float) -> SurfacePoint:
    """A point of the chart in which the performer's wrinkles are given."""
    chart = hand_made("wrinkles")
    x, y, z = face.smooth.T
    off = (chart["radius"] * np.arctan2(x, z - chart["axis_z"]) - along) ** 2 + (y - up) ** 2
    nearest = int(np.argmin(np.where(z > chart["axis_z"], off, np.inf)))
    return snapped(face.surface, face.smooth[nearest][None])[0]


@pytest.fixture(scope="module")
def line(face: DetailTake) -> Curve:
    """The upper wrinkle."""
    return drawn(face.surface, [_point(face, s, y) for s, y in LINE])


def _heights(face: DetailTake, details: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Normal part of the details along a straight way over the skin."""
    points = snapped(face.surface, np.linspace(start, end, 41))
    weights, corners = np.array([p.weights for p in points]), face.surface.triangles[[p.triangle for p in points]]
    return np.einsum("nk,nk->n", weights, details[corners, 2])


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a, b)[0, 1])


def test_a_forehead_line_is_removed_and_nothing_else(face: DetailTake, line: Curve) -> None:
    region = within(face.surface, line, 0.6)
    change = solve_detail_edit(ScaleEdit(region=region, frame=KEY, factor=0.0), face)
    everything = np.arange(face.n_vertices)
    before, after = face.dynamic(0, 2, everything), face.changed(change).dynamic(0, 2, everything)
    assert (after[KEY, region.vertices] ** 2).sum() <= 0.05 * (before[KEY, region.vertices] ** 2).sum()
    reach = banded(face.surface, region, 3 * face.surface.edge(region.vertices)).vertices
    outside = np.setdiff1d(everything, reach)
    assert (after[:, outside] == before[:, outside]).all()


def test_mirrored_its_profile_is_found_on_the_other_side(face: DetailTake, line: Curve) -> None:
    region = within(face.surface, line, 0.6)
    start = line.point(len(line) // 2)
    change = solve_detail_edit(PasteEdit(region=region, frame=KEY, start=start, mirror=True), face)
    everything = np.arange(face.n_vertices)
    before, after = (take.dynamic(KEY, KEY, everything)[0] for take in (face, face.changed(change)))
    mirror = Mirror(face.surface)
    middle = face.surface.place(start)
    there = face.surface.place(mirror.across(start))
    up = np.array([0.0, 0.7, 0.0])
    own = _heights(face, before, middle - up, middle + up)
    pasted = _heights(face, after, there - mirror.reflection @ up, there + mirror.reflection @ up)
    assert _correlation(own, pasted) > 0.95
    assert np.ptp(pasted) == pytest.approx(np.ptp(own), rel=0.15)


def test_on_a_cheek_its_profile_is_the_same(face: DetailTake, line: Curve) -> None:
    region = within(face.surface, line, 0.6)
    start, goal = line.point(len(line) // 2), _point(face, -4.6, -3.5)
    change = solve_detail_edit(PasteEdit(region=region, frame=KEY, start=start, goal=goal), face)
    everything = np.arange(face.n_vertices)
    before, after = (take.dynamic(KEY, KEY, everything)[0] for take in (face, face.changed(change)))
    turn = minimal_turn(*(_normal(face, point) for point in (start, goal)))
    middle, there, up = face.surface.place(start), face.surface.place(goal), np.array([0.0, 0.7, 0.0])
    up -= (up @ _normal(face, start)) * _normal(face, start)
    own = _heights(face, before, middle - up, middle + up)
    pasted = _heights(face, after, there - turn @ up, there + turn @ up)
    assert _correlation(own, pasted) > 0.95
    assert np.ptp(pasted) == pytest.approx(np.ptp(own), rel=0.15)


def test_reshaped_its_valley_lies_on_the_drawn_curve(face: DetailTake, line: Curve) -> None:
    goal = drawn(face.surface, [_point(face, s, y) for s, y in [(-4.9, 2.6), (-3.4, 2.2), (-1.8, 2.7)]])
    edit = ReshapeEdit(region=within(face.surface, line, 0.6), frame=KEY, curve=line, goal=goal)
    take = face.changed(solve_detail_edit(edit, face))
    after = take.dynamic(KEY, KEY, np.arange(face.n_vertices))[0]
    places = face.surface.places(goal)
    edge = face.surface.edge(np.unique(face.surface.triangles[goal.triangles]))
    off = []
    for k in range(len(goal) // 4, 3 * len(goal) // 4):
        across = np.cross(places[k + 1] - places[k - 1], _normal(face, goal.point(k)))
        across *= 0.6 / np.linalg.norm(across)
        profile = _heights(face, after, places[k] - across, places[k] + across)
        off.append(abs(np.linspace(-0.6, 0.6, 41)[int(np.argmin(profile))]))
    assert max(off) <= edge


def test_left_and_right_are_found(face: DetailTake) -> None:
    mirror = Mirror(face.surface)
    assert abs(mirror.normal[0]) > 0.999
    region = within(face.surface, drawn(face.surface, [_point(face, -5, 3), _point(face, -2, 3)]), 0.6)
    other = mirror.region(region)
    assert face.smooth[other.vertices, 0].min() > 1
    assert len(other) == pytest.approx(len(region), rel=0.1)
    back = mirror.region(other)
    assert len(np.setxor1d(back.vertices, region.vertices)) < 0.15 * len(region)


def _normal(face: DetailTake, point: SurfacePoint) -> np.ndarray:
    normal = np.array(point.weights) @ face.frames0[face.surface.triangles[point.triangle], :, 2]
    return np.asarray(normal / np.linalg.norm(normal))


def test_left_and_right_are_found_on_a_face_that_is_not_symmetric(face: DetailTake) -> None:
    """One cheek fuller, the nose and mouth drawn to a side; the truth from the symmetric head."""
    straight = face.smooth
    x, y, z = straight.T
    front = np.exp(-(((z - 2) / 4) ** 2))
    warped = straight + np.column_stack(
        [
            0.25 * np.exp(-(((y + 4) / 3) ** 2)) * front,
            0.15 * np.tanh(x / 3) * front,
            0.3 * np.exp(-((x - 4) ** 2 + (y + 3) ** 2) / 6),
        ]
    )
    surface = Surface(warped, face.mesh.triangles)
    mirror = Mirror(surface)
    rng = np.random.default_rng(3)
    some = rng.choice(np.flatnonzero((z > 0) & (np.abs(y) < 6) & (np.abs(x) > 1)), 60, replace=False)
    true = cKDTree(straight).query(straight[some] * [-1, 1, 1])[1]
    found = np.array([surface.place(mirror.across(surface.at_vertex(int(v)))) for v in some])
    off = np.linalg.norm(found - warped[true], axis=1)
    plain = np.linalg.norm(warped[some] * [-1, 1, 1] - warped[true], axis=1)
    assert np.median(off) < 0.2  # an edge; where skin has slid along itself, no shape tells
    assert np.median(off) < 0.8 * np.median(plain)
