"""Umeyama's similarity: known answers, optimality, bad input."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolkit.errors import InputError
from toolkit.rigid import umeyama


@pytest.mark.parametrize("seed", range(5))
def test_a_known_similarity_is_recovered(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points, rotation = rng.normal(size=(9, 3)), Rotation.random(random_state=seed).as_matrix()
    moved = 37.5 * points @ rotation.T + [5.0, -2.0, 900.0]
    fit = umeyama(points, moved)
    assert fit.scale == pytest.approx(37.5, rel=1e-12)
    np.testing.assert_allclose(fit.rotation, rotation, atol=1e-12)
    np.testing.assert_allclose(fit.apply(points), moved, atol=1e-9)
    np.testing.assert_allclose(fit.inverse().apply(moved), points, atol=1e-11)
    np.testing.assert_allclose(fit.then(fit.inverse()).apply(points), points, atol=1e-11)


def test_planar_points_and_half_turns() -> None:
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 2, 0.0]])
    turned = flat * [-1, 1, -1]
    fit = umeyama(flat, turned, scale=False)
    np.testing.assert_allclose(fit.apply(flat), turned, atol=1e-12)
    assert fit.scale == 1
    assert np.linalg.det(fit.rotation) == pytest.approx(1)


def test_the_fit_is_a_minimum() -> None:
    rng = np.random.default_rng(3)
    x, y, w = rng.normal(size=(20, 3)), rng.normal(size=(20, 3)), rng.uniform(size=20)

    def energy(scale: float, rotation: np.ndarray, translation: np.ndarray) -> float:
        return float(w @ np.sum((scale * x @ rotation.T + translation - y) ** 2, axis=1))

    fit = umeyama(x, y, w)
    best = energy(fit.scale, fit.rotation, fit.translation)
    for _ in range(30):
        small = Rotation.from_rotvec(rng.normal(size=3) * 1e-3).as_matrix()
        assert energy(fit.scale, small @ fit.rotation, fit.translation) >= best
        assert energy(fit.scale * (1 + 1e-3 * rng.normal()), fit.rotation, fit.translation) >= best
        assert energy(fit.scale, fit.rotation, fit.translation + 1e-3 * rng.normal(size=3)) >= best


def test_zero_weight_means_not_there() -> None:
    rng = np.random.default_rng(4)
    x = rng.normal(size=(8, 3))
    y = x + 1.0
    y[0] += 1e6
    fit = umeyama(x, y, np.array([0.0] + [1.0] * 7))
    np.testing.assert_allclose(fit.rotation, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(fit.translation, 1.0, atol=1e-12)


def test_a_mirrored_set_keeps_a_proper_rotation() -> None:
    x = np.random.default_rng(5).normal(size=(12, 3))
    assert np.linalg.det(umeyama(x, x * [-1, 1, 1]).rotation) == pytest.approx(1)


@pytest.mark.parametrize(
    ("x", "y", "w", "word"),
    [
        (np.zeros((4, 2)), np.zeros((4, 2)), None, r"\(4, 2\)"),
        (np.zeros((4, 3)), np.zeros((5, 3)), None, r"\(5, 3\)"),
        (np.eye(3), np.eye(3), [1, 1], "weights"),
        (np.eye(3), np.eye(3), [1, 1, -1], "weights"),
        (np.eye(3)[:2], np.eye(3)[:2], None, "2 corresponding"),
        (np.arange(12.0).reshape(4, 3), np.eye(4)[:, :3], None, "line"),
        (np.full((4, 3), np.nan), np.eye(4)[:, :3], None, "finite"),
    ],
)
def test_bad_input_is_refused(x: np.ndarray, y: np.ndarray, w: list[float] | None, word: str) -> None:
    with pytest.raises(InputError, match=word):
        umeyama(x, y, None if w is None else np.array(w))
