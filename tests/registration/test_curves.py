"""Lines on both faces: matching and the sheets that they part."""

from __future__ import annotations

import numpy as np

from toolkit.feature_lines import FeatureLine
from toolkit.registration.curves import (
    loops_of,
    match_lines,
    opposite_sheets,
    sheet_labels,
    source_rims,
    voted_labels,
)


def _matched(pair, lines: list[FeatureLine]):
    return match_lines(lines, pair.source.mesh, pair.target.mesh, pair.truth)


def test_a_line_picked_the_other_way_round_is_turned(pair) -> None:
    line = pair.lines[0]
    turned = FeatureLine(line.name, False, line.vertices, line.target_vertices[::-1])
    for given in (line, turned):
        (curve,) = _matched(pair, [given])
        assert curve.path[0] == pair.target.upper[0]
        np.testing.assert_allclose(curve.points[[0, -1]], pair.target.mesh.vertices[curve.path[[0, -1]]])


def test_a_closed_line_is_split_at_the_corners_from_any_start(pair) -> None:
    ring = np.concatenate([pair.source.upper, pair.source.lower[1:-1][::-1]])
    over = np.concatenate([pair.target.upper, pair.target.lower[1:-1][::-1]])
    for shift, step in ((0, 1), (7, 1), (11, -1)):
        line = FeatureLine("lip_inner", True, ring, np.roll(over, shift)[::step])
        curves = _matched(pair, [line])
        assert len(curves) == 2
        for curve in curves:
            is_upper = set(curve.vertices) == set(pair.source.upper)
            assert set(curve.path) == set(pair.target.upper if is_upper else pair.target.lower)
            assert curve.vertices[0] in pair.source.lower[[0, -1]]


def test_lines_without_a_partner_give_loops_only(pair) -> None:
    lines = [FeatureLine(line.name, line.closed, line.vertices) for line in pair.lines]
    assert _matched(pair, lines) == []
    (loop,) = loops_of(source_rims(lines, pair.source.mesh))
    assert set(loop) == set(pair.source.upper) | set(pair.source.lower)


def test_votes_beside_the_lips_lead_to_their_edges(pair) -> None:
    face = pair.target
    x, y = face.mesh.vertices[:, :2].T
    near = (np.abs(x) < 0.3) & ~face.bag
    middle = face.mesh.vertices[face.upper, 1].mean()
    upper, lower = (np.flatnonzero(near & (np.abs(y - middle - side * 0.12) < 0.04)) for side in (1, -1))
    labels = voted_labels(face.mesh, ~face.bag, upper, lower, 0.9)
    inner = slice(len(face.upper) // 4, -len(face.upper) // 4)
    assert np.all(labels[face.upper[inner]] == 1)
    assert np.all(labels[face.lower[inner]] == -1)
    assert not voted_labels(face.mesh, ~face.bag, upper, lower[:0], 0.9).any()


def test_sheets_are_told_apart_where_they_touch(pair) -> None:
    curves = _matched(pair, pair.lines)
    face = pair.source
    labels = sheet_labels(face.mesh, ~face.bag, curves, on_target=False)["lip_inner"]
    middle = slice(len(face.upper) // 3, -len(face.upper) // 3)
    assert np.all(labels[face.upper[middle]] == 1)
    assert np.all(labels[face.lower[middle]] == -1)
    assert not labels[face.bag].any()
    assert not labels[face.upper[[0, -1]]].any()
    y = face.mesh.vertices[:, 1]
    assert np.all(y[labels == 1] >= -0.5 - 1e-9)
    assert np.all(y[labels == -1] <= -0.5 + 1e-9)
    hidden = opposite_sheets(face.mesh.triangles, labels, 1)
    assert hidden.any()
    assert np.all(labels[face.mesh.triangles[hidden]] == -1)
