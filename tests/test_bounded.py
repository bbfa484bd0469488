from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import lsq_linear

import toolkit.bounded
from toolkit.banded import Bands, ChainBands, FrameBands, FrameRows
from toolkit.bounded import minimise


class Dense:
    """``|A x - b|^2`` written out."""

    def __init__(self, matrix: np.ndarray, goal: np.ndarray) -> None:
        self.square, self.pull = matrix.T @ matrix, matrix.T @ goal
        self.diagonal = np.diag(self.square)

    def gradient(self, x: np.ndarray) -> np.ndarray:
        return self.square @ x - self.pull

    def system(self, *, extra: np.ndarray | None = None, stuck: np.ndarray | None = None) -> Dense:
        made = self.square + np.diag(np.zeros_like(self.pull) if extra is None else extra)
        if stuck is not None:
            made[stuck] = made[:, stuck] = 0
            made[stuck, stuck] = 1
        self.solve = lambda right: np.linalg.solve(made, right)
        return self


@pytest.mark.parametrize("seed", range(6))
def test_equals_an_active_set_solver(seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix, goal, lower = rng.normal(size=(40, 25)), rng.normal(size=40), -rng.uniform(0, 0.1, 25)
    matrix[:, 5:] += 3 * matrix[:, :-5]
    found = minimise(Dense(matrix, goal), lower, np.zeros(25))
    slow = lsq_linear(matrix, goal, (lower, np.inf), method="bvls", tol=1e-14)
    assert 0 < np.count_nonzero(found == lower) < 25
    np.testing.assert_allclose(found, slow.x, atol=1e-8)


def test_meets_the_optimality_conditions_where_bounds_hardly_matter() -> None:
    """Half of the numbers would stay at their bounds without them, too: no force tells that they are there."""
    rng = np.random.default_rng(1)
    matrix, answer = rng.normal(size=(60, 40)), np.where(np.arange(40) % 2, 1.0, 0.0)
    problem = Dense(matrix, matrix @ answer + 1e-7 * rng.normal(size=60))
    found = minimise(problem, np.zeros(40), np.full(40, 0.5))
    slope = problem.gradient(found) / problem.diagonal
    assert np.abs(np.minimum(found, slope)).max() < 1e-9
    np.testing.assert_allclose(found, answer, atol=1e-6)


def test_where_corrections_end_nowhere_the_interior_point_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(4)
    problem = Dense(rng.normal(size=(40, 25)), rng.normal(size=40))
    exact = minimise(problem, np.zeros(25), np.ones(25))
    monkeypatch.setattr(toolkit.bounded, "_corrected", lambda *_: None)
    rough = minimise(problem, np.zeros(25), np.ones(25))
    assert np.array_equal(rough == 0, exact == 0)
    np.testing.assert_allclose(rough, exact, atol=1e-9)


def banded(n: int, rng: np.random.Generator) -> sp.csr_matrix:
    root = np.triu(np.tril(rng.normal(size=(n, n)), 2)) + 2 * np.eye(n)
    return sp.csr_matrix(root.T @ root)


@pytest.mark.parametrize("n", [1, 2, 3, 9])
@pytest.mark.parametrize("kind", ["chains", "diagonal blocks", "full blocks"])
def test_factors_are_those_of_the_dense_matrix(n: int, kind: str) -> None:
    rng = np.random.default_rng(n)
    half, time = rng.normal(size=(3, 3)), banded(n, rng)
    gram, unit = half @ half.T, sp.csr_matrix(sp.identity(n))
    bands: Bands = {
        "chains": lambda: ChainBands(time, 3),
        "diagonal blocks": lambda: FrameBands([(time, np.eye(3)), (unit, gram)]),
        "full blocks": lambda: FrameBands([(time, gram)]),
    }[kind]()
    full = np.kron(time.toarray(), gram if kind == "full blocks" else np.eye(3))
    full += np.kron(np.eye(n), gram if kind == "diagonal blocks" else np.zeros((3, 3)))
    np.testing.assert_allclose(bands.diagonal.ravel(), np.diag(full))
    extra, stuck = rng.uniform(0, 1, (n, 3)), rng.uniform(size=(n, 3)) < 0.3
    free = ~stuck.ravel()
    full = np.where(np.outer(free, free), full + np.diag(extra.ravel()), np.eye(3 * n))
    factor, right = bands.factor(extra, stuck), rng.normal(size=(n, 3))
    np.testing.assert_allclose(factor.solve(right).ravel(), np.linalg.solve(full, right.ravel()), atol=1e-12)
    rows = FrameRows(np.sort(rng.integers(0, n, 4)), rng.normal(size=(4, 3)))
    wide = np.zeros((4, n, 3))
    wide[np.arange(4), rows.frames] = rows.local
    wide = wide.reshape(4, -1)
    np.testing.assert_allclose(factor.answers(rows), wide @ np.linalg.solve(full, wide.T), atol=1e-12)


def test_a_matrix_that_is_not_definite_is_refused() -> None:
    time = sp.csr_matrix(sp.identity(4))
    with pytest.raises(np.linalg.LinAlgError, match="definite"):
        FrameBands([(time, np.array([[1.0, 2.0], [2.0, 1.0]]))]).factor()
