from __future__ import annotations

import json

import numpy as np
import pytest

from toolkit.detail_edit import (
    Curve,
    GainEdit,
    PasteEdit,
    Region,
    ReshapeEdit,
    ScaleEdit,
    SurfacePoint,
    from_data,
    to_data,
)
from toolkit.errors import InputError

REGION = Region(np.array([4, 7, 9]), np.array([1.0, 1 / 3, 0.5]))
CURVE = Curve(np.array([3, 5]), np.array([[0.2, 0.3, 0.5], [1.0, 0.0, 0.0]]))
EDITS = [
    ScaleEdit(region=REGION, frame=12, factor=-0.5, window=(3, 20), details="static"),
    PasteEdit(region=REGION, frame=3, start=SurfacePoint(8, (0.5, 0.25, 0.25)), mirror=True, source_shot="other"),
    PasteEdit(region=REGION, frame=3, start=CURVE.point(0), goal=CURVE.point(1), rotation=30.0, source_frame=7),
    ReshapeEdit(region=REGION, frame=5, curve=CURVE, goal=CURVE, propagation="gradients"),
    GainEdit(gains=((0, 0.5),)),
    GainEdit(gains=((0, 0.5), (9, 2.0)), region=REGION),
]


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: type(edit).__name__)
def test_an_edit_comes_back_from_json_exactly(edit: ScaleEdit) -> None:
    data = json.loads(json.dumps(to_data(edit), allow_nan=False))
    back = from_data(data)
    assert type(back) is type(edit)
    assert to_data(back) == to_data(edit)


def test_what_is_as_by_default_is_left_out() -> None:
    assert set(to_data(EDITS[2])) == {"kind", "region", "frame", "start", "goal", "rotation", "source_frame"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "melt"}, "'melt' is no detail edit"),
        ({"factr": 2}, "'factr' is unknown"),
        ({"frame": 1.5}, "1.5 is no whole number"),
        ({"region": {"weights": [1]}}, "make no sense"),
        ({"region": {"vertices": [1, 2], "weights": [1]}}, "both must be"),
        ({"window": [1, 2, 3]}, "make no sense"),
        ({"propagation": "magic"}, "'magic' is unknown"),
        ({"factor": None}, "make no sense"),
    ],
)
def test_faulty_data_is_refused_with_its_place(change: dict, message: str) -> None:
    data = to_data(EDITS[0]) | change
    with pytest.raises(InputError, match=message) as caught:
        from_data(data, where="edits.jsonl, line 3")
    assert "edits.jsonl, line 3" in str(caught.value)
