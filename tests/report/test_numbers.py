from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from toolkit.registration.quality import RegistrationQuality
from toolkit.report.glossary import explain
from toolkit.report.numbers import format_value, number_rows


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (True, "yes"),
        (105550, "105\u202f550"),
        (0.123456, "0.1235"),
        (np.float32(2.5), "2.5"),
        ([1, 2.5, "x"], "1, 2.5, x"),
        (np.arange(20), "0, 1, 2, 3, 4, 5, 6, 7, … (20 in all)"),
        ([], "none"),
        ("mm", "mm"),
    ],
)
def test_values_are_printed_sensibly(value, text):
    assert format_value(value) == text


def test_shares_are_percents_with_a_verdict():
    rows = number_rows({"flipped_share": 0.0012, "wrong_sheet": {"eyes": 0.004, "lips": 0.5}})
    assert [row.value for row in rows] == ["0.12 %", "0.4 %", "50 %"]
    assert [row.verdict for row in rows] == ["good", "fair", "poor"]
    assert rows[2].name == "Wrong sheet · lips"


def test_an_explanation_is_given_once():
    rows = number_rows({"flipped_a": 0.1, "flipped_b": 0.2, "unheard_of": 3})
    assert rows[0].judge
    assert rows[1].judge == ""
    assert rows[2].judge == ""


def test_what_is_not_finite_has_no_verdict():
    assert number_rows({"flipped": float("nan")})[0].verdict == ""


def test_settings_are_not_judged_and_rounding_is_nothing():
    (limit,) = number_rows({"register": {"max_flips": 0.05}}, judged=False)
    assert (limit.value, limit.judge, limit.verdict) == ("0.05", "", "")
    (found,) = number_rows({"distance_median_share": 4e-9})
    assert (found.value, found.verdict) == ("0 %", "good")


def test_every_share_of_the_registration_is_explained_and_shown_in_percent():
    shares = [one.name for one in fields(RegistrationQuality) if one.name.endswith("share")]
    assert len(shares) > 5
    for name in shares:
        entry = explain(name)
        assert entry is not None, name
        assert entry.share, name
