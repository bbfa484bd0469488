from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from toolkit.banded import FrameRows
from toolkit.pose_edit.weights_step import WeightsProblem, time_matrix


@pytest.mark.parametrize("room", [0.3, 100.0])
@pytest.mark.parametrize("with_gram", [False, True])
@pytest.mark.parametrize("with_opening", [False, True])
def test_the_weights_step_equals_a_dense_bounded_solve(with_opening: bool, with_gram: bool, room: float) -> None:
    rng = np.random.default_rng(8)
    n, k, r = 12, 3, 4
    for tied in ((True, True), (False, True), (False, False)):
        time = time_matrix(n, *tied, smoothness=1.5)
        half = rng.normal(size=(k, k))
        gram = half @ half.T if with_gram else None
        opening = rng.uniform(0, 2, (n, k)) if with_opening else None
        problem = WeightsProblem(time, gram, -room * rng.uniform(0.1, 1, (n, k)), opening)
        seen = FrameRows(np.array([3, 3, 8, 8]), rng.normal(size=(r, k)))
        rows = np.zeros((r, n, k))
        rows[np.arange(r), seen.frames] = seen.local
        goals = 3 * rng.normal(size=r)
        root = rng.normal(size=(r, r)) + 3 * np.eye(r)
        found = problem.solve(seen, goals, np.linalg.inv(root.T @ root), np.zeros((n, k)))
        blocks = [np.kron(np.linalg.cholesky(time.toarray()).T, np.eye(k)), root @ rows.reshape(r, -1)]
        if with_gram:
            blocks.append(np.kron(np.eye(n), half.T))
        if opening is not None:
            blocks.append(np.diag(np.sqrt(opening).ravel()))
        stacked = np.vstack(blocks)
        right = np.zeros(len(stacked))
        right[n * k : n * k + r] = root @ goals
        slow = lsq_linear(stacked, right, (problem.lower.ravel(), np.inf), method="bvls", tol=1e-14)
        assert (found >= problem.lower).all()
        at_bound = int((found == problem.lower).sum())
        assert 0 < at_bound < found.size if room < 1 else at_bound == 0
        assert np.abs(found.ravel() - slow.x).max() < 1e-7


def test_a_drag_needs_no_interior_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """From the last solution on, the next one is found by its zeros alone, and is the same."""
    rng = np.random.default_rng(3)
    n, k = 60, 5
    problem = WeightsProblem(time_matrix(n, True, True, smoothness=3.0), None, -0.2 * rng.uniform(0, 1, (n, k)) ** 2)
    rows = FrameRows(np.array([20, 30, 45]), rng.normal(size=(3, k)))
    goals, metric = rng.normal(size=3), 0.1 * np.eye(3)
    last = problem.solve(rows, goals, metric, np.zeros((n, k)))
    assert 0 < (last == problem.lower).sum() < last.size
    asked = [1.02 * goals, 1.04 * goals, goals]
    cold = [problem.solve(rows, one, metric, np.zeros((n, k))) for one in asked]
    monkeypatch.setattr("toolkit.bounded._interior_point", None)
    for one, other in zip(asked, cold, strict=True):
        last = problem.solve(rows, one, metric, last)
        assert np.abs(last - other).max() < 1e-9
