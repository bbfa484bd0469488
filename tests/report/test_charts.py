from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from toolkit.report import heat_chart, line_chart


def _parse(chart: str) -> ET.Element:
    return ET.fromstring(f"<div>{chart}</div>")


def _points(element: ET.Element) -> list[np.ndarray]:
    paths = [p.get("d") for p in element.iter("path") if p.get("stroke")]
    return [np.array([[float(c) for c in pair.split()] for pair in re.split("[ML]", d)[1:]]) for d in paths]


def test_a_line_is_drawn_to_scale():
    (points,) = _points(_parse(line_chart({"y": [0.0, 1.0, 4.0]})))
    rise = np.diff(points[:, 1])
    assert np.diff(points[:, 0]) == pytest.approx(np.diff(points[:, 0])[0] * np.ones(2), abs=0.11)
    assert rise[1] == pytest.approx(3 * rise[0], abs=0.3)
    assert rise[0] < 0  # upwards on the screen


def test_gaps_break_the_line_and_the_axis_survives_them():
    pieces = _points(_parse(line_chart({"y": [0, 1, np.nan, 1, 2, np.inf, 3]})))
    assert [len(p) for p in pieces] == [2, 2, 1]


@pytest.mark.parametrize("values", [[], [3.0], [2.0, 2.0, 2.0], [np.nan, np.nan]])
def test_thin_data_still_makes_a_chart(values):
    assert _parse(line_chart({"a": values, "b": values})).find("svg") is not None


def test_names_are_escaped_and_every_curve_is_in_the_legend():
    chart = line_chart({"a<b": [1, 2], "c&d": [2, 1]}, y_label="x < y")
    texts = "".join(_parse(chart).itertext())
    assert all(t in texts for t in ("a<b", "c&d", "x < y"))


def test_heat_chart_embeds_one_pixel_per_value():
    import base64
    import io

    from PIL import Image

    image = next(_parse(heat_chart(np.eye(3, 5))).iter("image"))
    data = base64.b64decode(image.get("href").split(",", 1)[1])
    assert Image.open(io.BytesIO(data)).size == (5, 3)
