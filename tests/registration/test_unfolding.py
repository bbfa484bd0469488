import numpy as np
import pytest

from toolkit.mesh import TriangleMesh, face_normals
from toolkit.registration.surface import Surface
from toolkit.registration.unfolding import unfold


@pytest.fixture(scope="module")
def sheet():
    n = 30
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    vertices = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(3 * x.ravel())], axis=1)
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    return TriangleMesh(vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32))


def _folded(sheet):
    """Scaled and turned, with a pleat: vertices of a small disc mirrored about its middle."""
    points = sheet.vertices.copy()
    disc = np.linalg.norm(points[:, :2] - 0.5, axis=1) < 0.09
    points[disc, 0] = 1.0 - points[disc, 0]
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    return 2.5 * points @ turn.T + 7, 2.5 * sheet.vertices @ turn.T + 7, disc


def _target(sheet, flat):
    return Surface(sheet.with_vertices(flat)).closest


def test_a_pleat_is_laid_flat_and_the_rest_stays(sheet):
    points, flat, disc = _folded(sheet)
    everything = np.ones(len(points), dtype=bool)
    assert (face_normals(points, sheet.triangles)[:, 2] < 0).sum() > 10
    found = unfold(sheet, points, everything, _target(sheet, flat))
    assert (face_normals(found, sheet.triangles)[:, 2] > 0).all()
    far = np.linalg.norm(sheet.vertices[:, :2] - 0.5, axis=1) > 0.35
    assert np.array_equal(found[far], points[far])
    assert np.abs(found[disc] - flat[disc]).max() < 0.03 * 2.5
    assert Surface(sheet.with_vertices(flat)).closest(found).distance.max() < 1e-3


def test_what_is_flat_already_is_untouched(sheet):
    _, flat, _ = _folded(sheet)
    assert unfold(sheet, flat, np.ones(len(flat), dtype=bool), _target(sheet, flat)) is flat


def test_what_is_not_skin_is_not_moved(sheet):
    points, flat, disc = _folded(sheet)
    found = unfold(sheet, points, ~disc, _target(sheet, flat))
    assert np.array_equal(found[disc], points[disc])
