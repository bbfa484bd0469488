from __future__ import annotations

import numpy as np
import pytest

from toolkit.rendering import ColorScale, add_legend


def test_ends_and_middle_of_a_signed_scale():
    scale = ColorScale.signed(np.array([-1.0, 2.0, 0.0]), percentile=100)
    assert (scale.low, scale.high) == (-2.0, 2.0)
    low, middle, high = scale.colors([-2.0, 0.0, 2.0]).astype(int)
    assert low[2] > low[0] + 80  # blue
    assert high[0] > high[2] + 80  # red
    assert np.ptp(middle) < 8  # neutral


def test_unsigned_scale_ignores_few_outliers_and_clips_them():
    values = np.r_[np.linspace(0, 1, 1000), 1e6]
    scale = ColorScale.unsigned(values)
    assert scale.high == pytest.approx(0.99, abs=0.01)
    assert (scale.colors([1e6]) == scale.colors([scale.high])).all()


def test_colours_follow_the_value_in_order():
    colors = ColorScale(0, 1, cmap="viridis").colors(np.linspace(0, 1, 50)).astype(float)
    luminance = colors @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(luminance) > 0).all()


def test_what_is_not_finite_is_grey_and_a_zero_field_has_a_scale():
    scale = ColorScale.unsigned(np.zeros(5))
    assert scale.high > scale.low
    assert (scale.colors([np.nan, np.inf]) == 128).all()


@pytest.mark.parametrize(("low", "high"), [(0, 0.0123), (-3.7, 3.7), (0, 412)])
def test_ticks_are_few_and_inside(low, high):
    ticks = ColorScale(low, high).ticks()
    assert 3 <= len(ticks) <= 7
    assert low - 1e-9 <= min(ticks)
    assert max(ticks) <= high + 1e-9


def test_legend_shows_the_ramp_the_label_and_the_unit():
    image = np.full((50, 400, 3), 9, np.uint8)
    scale = ColorScale(0, 1, "coating", "mm")
    full = add_legend(image, scale)
    assert (full[:50] == image).all()
    strip = full[50:]
    ramp = scale.colors(np.linspace(0, 1, 336))
    assert any((row[32:368] == ramp).all() for row in strip)
    assert (add_legend(image, ColorScale(0, 1, "coating", "cm")) != full).any()
    assert (add_legend(image, ColorScale(0, 1, "motion", "mm")) != full).any()
