"""Landmark files, and landmarks that cannot be right."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from toolkit.errors import InputError, RegistrationError
from toolkit.registration.consistency import misfit, refuse_contradictions
from toolkit.registration.landmarks import Landmarks, load_landmarks, save_landmarks


def test_a_file_is_read_back(tmp_path: Path) -> None:
    marks = Landmarks.of([3, 1, 4], [1, 5, 9], ["nose", "chin", "ear"])
    save_landmarks(tmp_path / "landmarks.json", marks)
    back = load_landmarks(tmp_path / "landmarks.json")
    assert back.names == marks.names
    np.testing.assert_array_equal(back.source, marks.source)
    np.testing.assert_array_equal(back.target, marks.target)
    assert json.loads((tmp_path / "landmarks.json").read_text())["pairs"][1] == {
        "name": "chin",
        "source": 1,
        "target": 5,
    }


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("{", "no landmark file"),
        ('{"points": []}', "pairs"),
        ('{"pairs": [{"name": "a", "source": 1}]}', "pair 0: target"),
        ('{"pairs": [{"source": 1, "target": 2}, {"source": 1.5, "target": 2}]}', "pair 1: source is 1.5"),
        ('{"pairs": [{"source": true, "target": 2}]}', "True"),
        ('{"pairs": [{"source": 1, "target": 1000000000000000000000}]}', "pair 0: target is 10+, no vertex id"),
        ('{"pairs": [7]}', "pair 0 is 7"),
    ],
)
def test_a_bad_file_is_refused(tmp_path: Path, text: str, word: str) -> None:
    path = tmp_path / "landmarks.json"
    path.write_text(text)
    with pytest.raises(InputError, match=word):
        load_landmarks(path)


def test_a_byte_order_mark_does_not_matter(tmp_path: Path) -> None:
    path = tmp_path / "landmarks.json"
    path.write_text('{"pairs": [{"name": "chin", "source": 3, "target": 4}]}', encoding="utf-8-sig")
    assert load_landmarks(path).source.tolist() == [3]


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_landmarks(tmp_path / "landmarks.json")


def _check(pair, landmarks: Landmarks) -> list[str]:
    return refuse_contradictions(landmarks, pair.source.mesh.vertices, pair.target.mesh.vertices)


def _with_target(pair, changes: dict[int, int]) -> Landmarks:
    target = pair.landmarks.target.copy()
    for k, vertex in changes.items():
        target[k] = vertex
    return Landmarks.of(pair.landmarks.source, target, pair.landmarks.names)


def test_correct_landmarks_pass_without_a_word(pair) -> None:
    assert _check(pair, pair.landmarks) == []


@pytest.mark.parametrize(("a", "b"), [(0, 13), (5, 18), (10, 30)])
def test_two_exchanged_pairs_are_named(pair, a: int, b: int) -> None:
    marks = _with_target(pair, {a: int(pair.landmarks.target[b]), b: int(pair.landmarks.target[a])})
    with pytest.raises(RegistrationError) as caught:
        _check(pair, marks)
    assert f"'place {a}'" in str(caught.value)
    assert f"'place {b}'" in str(caught.value)
    assert "exchanged" in str(caught.value)


@pytest.mark.parametrize("k", [2, 9, 17, 25])
def test_a_misplaced_pair_is_named(pair, k: int) -> None:
    points = pair.target.mesh.vertices
    far = int(np.argmax(np.linalg.norm(points - points[pair.landmarks.target[k]], axis=1)))
    with pytest.raises(RegistrationError, match=f"contradict.*'place {k}'"):
        _check(pair, _with_target(pair, {k: far}))


def test_misfit_is_zero_for_similar_faces_and_has_no_unit(pair) -> None:
    p = pair.source.mesh.vertices[pair.landmarks.source]
    assert misfit(p, 30 * p[:, [1, 2, 0]] + 4) == pytest.approx(0, abs=1e-12)
    assert misfit(p, pair.truth[pair.landmarks.source] * 100) == pytest.approx(
        misfit(p * 7 + 1, pair.truth[pair.landmarks.source])
    )
