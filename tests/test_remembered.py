from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from toolkit.remembered import remembered


@dataclass(frozen=True)
class Strength:
    steps: int
    weights: np.ndarray | None = None


def test_the_same_content_is_asked_for_once() -> None:
    asked = []

    @remembered
    def total(values: np.ndarray, strength: Strength, shift: float | None = None) -> float:
        asked.append(strength.steps)
        return float(values.sum()) * strength.steps + (shift or 0)

    values = np.arange(6.0)
    assert total(values, Strength(2)) == total(values.copy(), Strength(2)) == 30
    assert asked == [2]
    # Whatever differs, be it the shape alone, is another question.
    for other in (values.reshape(2, 3), values.astype(np.float32), values + 1):
        total(other, Strength(2))
    total(values, Strength(3))
    total(values, Strength(3), shift=1.0)
    total(values, Strength(3, np.ones(2)))
    assert len(asked) == 7


def test_only_the_last_two_are_kept() -> None:
    asked = []

    @remembered
    def same(value: int) -> int:
        asked.append(value)
        return value

    for value in (1, 2, 1, 3, 1, 2):
        assert same(value) == value
    assert asked == [1, 2, 3, 2]
