import numpy as np

from benchmarks._registration.floor import drifted, floor, relief_misfits
from data.guides import guide_lines
from toolkit.registration import Landmarks


def test_the_oracle_finds_a_map_that_smoothness_gives(pair):
    """A similarity bends nothing, so landmarks alone give it back; another person's shape they give nearly."""
    source, skin = pair.source.mesh, ~pair.source.bag
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    moved = 1.3 * source.vertices @ turn.T + 2
    kept = floor(source, moved, {"skin": skin}, pair.landmarks.source, [], skin, 500)["skin"].vertices
    assert np.linalg.norm(kept - moved, axis=1)[skin].mean() < 0.01  # what the decimated mesh cannot express
    best = floor(source, pair.truth, {"skin": skin}, pair.landmarks.source, [], skin, 500)["skin"]
    error = np.linalg.norm(best.vertices - pair.truth, axis=1)[skin]
    assert best.error == error.mean()
    assert 1e-6 < best.error < 0.004 * pair.target.mesh.diagonal


def test_the_truth_drifts_only_as_far_as_landmarks_leave_it_free(pair):
    """Nothing draws a similar shape away; another person's slides, the farther the fewer landmarks."""
    source, target, skin = pair.source.mesh, pair.target.mesh, ~pair.source.bag
    size = target.diagonal

    def drift(onto, truth, marks):
        gone = drifted(source, onto, truth, marks, [], 500)
        return np.linalg.norm(gone - truth, axis=1)[skin].mean() / size

    few = Landmarks.of(pair.landmarks.source[::3], pair.landmarks.target[::3])
    itself = Landmarks.of(pair.landmarks.source, pair.landmarks.source)
    moved = 1.3 * source.vertices + 2
    still = drift(source.with_vertices(moved), moved, itself)
    near, far = drift(target, pair.truth, pair.landmarks), drift(target, pair.truth, few)
    assert still < 0.004  # what the decimated mesh cannot express
    assert near < far < 0.05


def test_true_lines_bring_the_oracle_nearer(pair):
    source, skin = pair.source.mesh, ~pair.source.bag
    ids = pair.landmarks.source[:16]
    middle = np.argsort(source.vertices[skin, 1])[skin.sum() // 2]
    row = np.flatnonzero(skin & (np.abs(source.vertices[:, 1] - source.vertices[skin][middle, 1]) < 1e-9))
    stops = {"row": row[np.argsort(source.vertices[row, 0])][[0, -1]].tolist()}
    lines = guide_lines(source, pair.target.mesh, pair.truth, stops, 2.4)
    assert len(lines) == 1
    assert len(lines[0].target_vertices) > 10
    errors = [floor(source, pair.truth, {"skin": skin}, ids, x, skin, 500)["skin"].error for x in ([], lines)]
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
