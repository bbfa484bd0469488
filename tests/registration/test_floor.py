import numpy as np

from benchmarks._registration.floor import floor, relief_misfits
from benchmarks._registration.guides import GUIDES, guide_lines, sample_stops


def test_the_oracle_finds_a_map_that_smoothness_gives(pair):
    """A similarity bends nothing, so landmarks alone give it back; another person's shape they give nearly."""
    source, skin = pair.source.mesh, ~pair.source.bag
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    moved = 1.3 * source.vertices @ turn.T + 2
    kept = floor(source, moved, skin, pair.landmarks.source, [], skin, 500).vertices
    assert np.linalg.norm(kept - moved, axis=1)[skin].mean() < 0.01  # what the decimated mesh cannot express
    best = floor(source, pair.truth, skin, pair.landmarks.source, [], skin, 500)
    error = np.linalg.norm(best.vertices - pair.truth, axis=1)[skin]
    assert 1e-6 < error.mean() < 0.004 * pair.target.mesh.diagonal


def test_true_lines_bring_the_oracle_nearer(pair):
    source, skin = pair.source.mesh, ~pair.source.bag
    ids = pair.landmarks.source[:16]
    middle = np.argsort(source.vertices[skin, 1])[skin.sum() // 2]
    row = np.flatnonzero(skin & (np.abs(source.vertices[:, 1] - source.vertices[skin][middle, 1]) < 1e-9))
    stops = {"row": row[np.argsort(source.vertices[row, 0])][[0, -1]].tolist()}
    lines = guide_lines(source, pair.target.mesh, pair.truth, stops, 2.4)
    assert len(lines) == 1
    assert len(lines[0].target_vertices) > 10
    errors = [
        np.linalg.norm(floor(source, pair.truth, skin, ids, x, skin, 500).vertices - pair.truth, axis=1)[skin].mean()
        for x in ([], lines)
    ]
    assert errors[1] < errors[0]


def test_relief_tells_a_place_from_another(pair):
    source, skin = pair.source.mesh, ~pair.source.bag
    inner = skin & (np.abs(source.vertices[:, 0]) < 0.6) & (np.abs(source.vertices[:, 1]) < 0.9)
    beside = source.vertices + [0.15, 0, 0]
    beside[:, 2] = source.vertices[:, 2]
    true, there, off = relief_misfits(source, source, source.vertices, beside, inner, 2.4)
    assert off == 1
    assert true < 1e-12
    assert there > 0.01


def test_guides_are_on_both_sides_and_the_midline_once():
    words = {word for line in GUIDES.values() for word in line.split()}
    middle = {word for word in words if word in set(GUIDES["midline_upper"].split() + GUIDES["midline_lower"].split())}
    names = {name: k for k, name in enumerate(sorted(middle))}
    names |= {f"{w}_{s}": 100 + k for k, (w, s) in enumerate((w, s) for w in sorted(words - middle) for s in "lr")}
    stops = sample_stops(names)
    assert len(stops) == 2 * len(GUIDES) - 2
    assert {"midline_upper_l", "jaw_l", "jaw_r"} <= set(stops)
