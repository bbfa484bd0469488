from __future__ import annotations

import json
from pathlib import Path

import pytest

from toolkit.errors import InputError
from toolkit.pose_edit import (
    DistanceConstraint,
    EditParameters,
    FixedConstraint,
    PointConstraint,
    from_data,
    to_data,
)
from toolkit.shot.journal import Journal

CONSTRAINTS = [
    PointConstraint(3, 7, place=(0.1, 1 / 3, 0.3)),
    PointConstraint(3, 8, offset=(0.0, 1.0, 0.0), weight=2.0),
    DistanceConstraint(5, (1, 2), factor=0.5),
    FixedConstraint((4, 5, 6)),
    FixedConstraint((4,), frames=(3, 5)),
]


def test_an_edit_comes_back_from_the_journal(tmp_path: Path) -> None:
    parameters = EditParameters(mode="weights", window=(2, 9), lambda_w=0.1)
    Journal(tmp_path / "edits.jsonl").add("pose", to_data(CONSTRAINTS, parameters))
    (edit,) = Journal(tmp_path / "edits.jsonl").replay().edits
    assert from_data(edit.data) == (CONSTRAINTS, parameters)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "no list"),
        ('{"constraints": [3]}', "3 is no constraint"),
        ('{"constraints": [{"kind": "line"}]}', "one of point, distance, fixed"),
        ('{"constraints": [{"kind": "point", "frame": 1, "vertx": 2}]}', "'vertx' is unknown; known are frame, vertex"),
        ('{"constraints": [{"kind": "point", "frame": 1, "vertex": 2}]}', "constraint 0: .* either a place or"),
        ('{"constraints": [{"kind": "point", "frame": 1, "vertex": 2, "place": "here"}]}', "make no sense"),
        ('{"constraints": [{"kind": "point", "frame": 1.5, "vertex": 2}]}', "1.5 is no number of a frame"),
        ('{"constraints": [], "parameters": {"mode": "all"}}', "mode cannot be 'all'"),
        ('{"constraints": [{"kind": "point"}]}', "make no sense .*missing"),
    ],
)
def test_what_a_user_wrote_wrong_is_named(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        from_data(json.loads(text), where="my.json")
