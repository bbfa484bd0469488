"""The thin-plate spline: interpolation, affine maps, leaving one out."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.registration.spline import ThinPlateSpline


@pytest.fixture
def points() -> np.ndarray:
    return np.random.default_rng(0).normal(size=(14, 3))


def test_it_passes_through_its_points(points: np.ndarray) -> None:
    values = points + 0.2 * np.sin(3 * points)
    np.testing.assert_allclose(ThinPlateSpline(points, values)(points), values, atol=1e-10)


def test_an_affine_map_is_reproduced_everywhere(points: np.ndarray) -> None:
    rng = np.random.default_rng(1)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    elsewhere = 10 * rng.normal(size=(50, 3))
    spline = ThinPlateSpline(points, points @ matrix.T + shift)
    np.testing.assert_allclose(spline(elsewhere), elsewhere @ matrix.T + shift, atol=1e-8)


def test_no_unit_enters(points: np.ndarray) -> None:
    values = points + 0.2 * np.sin(3 * points)
    x = np.random.default_rng(2).normal(size=(20, 3))
    for smoothing in (0.0, 0.3):
        small = ThinPlateSpline(points, values, smoothing)(x)
        large = ThinPlateSpline(1000 * points + 7, 1000 * values + 5, 1000 * smoothing)(1000 * x + 7)
        np.testing.assert_allclose((large - 5) / 1000, small, atol=1e-8)


@pytest.mark.parametrize("smoothing", [0.0, 0.5])
def test_leaving_one_out_equals_fitting_again(points: np.ndarray, smoothing: float) -> None:
    values = points + 0.3 * np.cos(2 * points)
    gaps = ThinPlateSpline(points, values, smoothing).leave_one_out()
    for k in range(len(points)):
        rest = np.arange(len(points)) != k
        again = ThinPlateSpline(points[rest], values[rest], smoothing)(points[k : k + 1])[0]
        np.testing.assert_allclose(gaps[k], values[k] - again, atol=1e-8)


def test_smoothing_gives_way_and_flattens(points: np.ndarray) -> None:
    values = points + 0.3 * np.random.default_rng(3).normal(size=points.shape)
    miss = [np.linalg.norm(ThinPlateSpline(points, values, s)(points) - values) for s in (0.0, 0.1, 1.0, 1e6)]
    assert np.all(np.diff(miss) > 0)
    affine = np.linalg.lstsq(np.column_stack([points, np.ones(14)]), values, rcond=None)[0]
    flat = np.column_stack([points, np.ones(14)]) @ affine
    np.testing.assert_allclose(ThinPlateSpline(points, values, 1e9)(points), flat, atol=1e-5)
