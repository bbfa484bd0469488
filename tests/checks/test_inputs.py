from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolkit.checks import check_inputs
from toolkit.errors import InputError
from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh
from toolkit.meshio.sequence import FrameSequence


@pytest.fixture
def inputs(head):
    frames = np.repeat(head.vertices[None], 9, axis=0).astype(np.float32)
    frames[4:, :, 2] *= 1.1
    ids = np.arange(0, 140, 4)
    return {
        "source": head,
        "sequence": FrameSequence(9, head.n_vertices, 30.0, "take.npy", lambda a, b: frames[a:b]),
        "target": head.with_vertices(100 * head.vertices),
        "names": [f"mark{i}" for i in ids],
        "source_ids": ids,
        "target_ids": ids,
    }


def test_good_inputs_come_through_untouched(inputs, caplog):
    with caplog.at_level("INFO"):
        checked = check_inputs(**inputs)
    assert checked.source is inputs["source"]
    assert checked.target is inputs["target"]
    assert "100 times the size" in caplog.text
    assert checked.notes == ()


def test_landmarks_follow_a_target_that_is_repaired(inputs, caplog):
    target = inputs["target"]
    loose = TriangleMesh(np.concatenate([[[1, 2, 3.0]], target.vertices]), (target.triangles + 1)[:, ::-1])
    given = inputs["target_ids"] + 1
    lines = [
        FeatureLine("lid", False, np.array([3, 9]), np.array([4, 10])),
        FeatureLine("lip", False, np.array([1, 2])),
    ]
    checked = check_inputs(**{**inputs, "target": loose, "target_ids": given, "lines": lines})
    np.testing.assert_array_equal(checked.target.vertices[checked.target_ids], loose.vertices[given])
    assert checked.lines[0].target_vertices.tolist() == [3, 9]
    assert checked.lines[1] is lines[1]
    assert len(checked.notes) == 2
    assert "removed 1 vertices" in caplog.text
    assert "turned all faces over" in caplog.text
    # Said once, as a repair, and not before as a complaint.
    assert "inside out" not in caplog.text


def test_a_guide_on_one_face_only_is_told(inputs):
    drawn = FeatureLine("jaw", False, np.array([3, 9]), np.array([4, 10]), guide=True)
    lines = [drawn, replace(drawn, name="brow", target_vertices=None), FeatureLine("lip", False, np.array([1, 2]))]
    findings = check_inputs(**{**inputs, "lines": lines}).findings
    (finding,) = (f for f in findings if "guide" in f.what)
    assert (finding.severity, finding.index) == ("warning", 1)
    assert "guide 'brow' is not drawn on the target" in finding.sentence


def test_a_landmark_that_only_a_broken_face_holds_is_refused(inputs):
    target = inputs["target"]
    n = target.n_vertices
    spike = TriangleMesh(
        np.concatenate([target.vertices, [[500, 0, 0.0]]]),
        np.concatenate([target.triangles, [[3, 3, n]]]).astype(np.int32),
    )
    ids = inputs["target_ids"].copy()
    ids[5] = n
    with pytest.raises(InputError, match=rf"'mark20' is on target vertex {n}, which only broken faces use"):
        check_inputs(**{**inputs, "target": spike, "target_ids": ids})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda i: {"source": i["source"].with_vertices(i["source"].vertices * np.nan)}, "source reference: vertex 0"),
        (lambda i: {"target": replace(i["target"], triangles=i["target"].triangles + 1)}, "ids run from 0"),
        (lambda i: {"lines": [FeatureLine("lid", True, np.array([3, 9, 9]))]}, "twice in a row"),
        (lambda i: {"lines": [FeatureLine("lid", False, np.array([3, 9]), np.array([-3, 9]))]}, "(target): feature"),
        (lambda i: {"target_ids": i["target_ids"] + 100}, "landmarks: landmark"),
        (lambda i: {"sequence": replace(i["sequence"], n_vertices=7)}, "the frames have 7"),
    ],
)
def test_each_step_refuses_before_the_take_is_read(inputs, change, words):
    def read(start, stop):
        if stop - start > 1:
            raise AssertionError("the take was read")
        return np.asarray(inputs["source"].vertices[None], dtype=np.float32)

    unread = {**inputs, "sequence": replace(inputs["sequence"], read_block=read)}
    with pytest.raises(InputError) as caught:
        check_inputs(**{**unread, **change(unread)})
    assert words in str(caught.value)
