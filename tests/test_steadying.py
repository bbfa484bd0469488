from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from toolkit.bases import BasisParameters, gram_matrix, select_bases
from toolkit.steadying import steady_weights


@pytest.fixture
def take() -> tuple[np.ndarray, np.ndarray]:
    """Frames (40, 90) on smooth curves, and bases (4, 90) that reach them only in part."""
    rng = np.random.default_rng(3)
    t = np.linspace(0, 1, 40)[:, None]
    curves = np.maximum(np.sin(2 * np.pi * (t * [1, 1.5, 2, 3, 2.5] + [0, 0.2, 0.4, 0.6, 0.1])), 0) ** 2
    frames = curves @ rng.normal(size=(5, 90))
    return frames, frames[[5, 12, 20, 31]]


def one_by_one(frames: np.ndarray, bases: np.ndarray) -> np.ndarray:
    return np.stack([nnls(bases.T, frame)[0] for frame in frames])


@pytest.mark.parametrize("bend", [0.0, 0.1])
def test_the_weights_equal_a_direct_solve(take, bend: float):
    frames, bases = take
    found = steady_weights(bases @ bases.T, frames @ bases.T, one_by_one(frames, bases), 2.0, bend=bend)
    second = np.diff(np.eye(len(frames)), n=2, axis=0)
    sizes = np.diag(np.linalg.norm(bases, axis=1))
    blocks = [(np.eye(len(frames)), bases.T), (np.sqrt(2.0) * second, bases.T), (np.sqrt(bend) * second, sizes)]
    matrix = np.concatenate([np.kron(time, shape) for time, shape in blocks])
    goal = np.concatenate(
        [frames.ravel(), np.sqrt(2.0) * (second @ frames).ravel(), np.zeros(len(second) * len(sizes))]
    )
    direct = nnls(matrix, goal)[0].reshape(found.shape)
    assert found.min() >= 0
    assert np.array_equal(found == 0, direct == 0)
    np.testing.assert_allclose(found, direct, atol=1e-9)


def test_what_is_left_out_becomes_calmer_at_little_cost(take):
    frames, bases = take
    alone = one_by_one(frames, bases)
    steady = steady_weights(bases @ bases.T, frames @ bases.T, alone, 1.0)
    left = [frames - weights @ bases for weights in (alone, steady)]
    unrest = [np.linalg.norm(np.diff(rest, n=4, axis=0)) for rest in left]
    assert unrest[1] < 0.8 * unrest[0]
    assert np.linalg.norm(left[1]) < 1.1 * np.linalg.norm(left[0])


def test_a_take_that_the_bases_reach_keeps_its_weights():
    rng = np.random.default_rng(0)
    bases, weights = rng.normal(size=(3, 60)), np.abs(rng.normal(size=(20, 3)))
    found = steady_weights(bases @ bases.T, (weights @ bases) @ bases.T, weights, 5.0)
    np.testing.assert_allclose(found, weights, atol=1e-9)


def left_to_gain(inner: np.ndarray, coupling: np.ndarray, strength: float, weights: np.ndarray) -> float:
    """How far the weights are from the optimality conditions, in units of each basis' size, beside the largest."""
    bend = np.diff(np.eye(len(weights)), n=2, axis=0)
    size = np.sqrt(np.diag(inner))
    slope = (np.eye(len(weights)) + strength * bend.T @ bend) @ (weights @ inner - coupling) / size
    return float(np.abs(np.minimum(weights * size, slope)).max() / (weights * size).max())


@pytest.mark.parametrize("strength", [0.3, 4.0, 100.0])
@pytest.mark.parametrize("apart", [1.0, 1e-2, 1e-3])
def test_bases_that_are_nearly_alike_give_the_optimum_all_the_same(apart: float, strength: float) -> None:
    rng = np.random.default_rng(5)
    t = np.arange(120)[:, None]
    frames = np.maximum(np.sin(rng.uniform(0.05, 0.3, 9) * t + rng.uniform(0, 6, 9)), 0) @ rng.normal(size=(9, 60))
    bases = frames[[10, 40, 70, 70, 100]] * [[1], [1], [1], [1 - apart], [1e-3]] + apart * rng.normal(size=(5, 60))
    inner, coupling = bases @ bases.T, frames @ bases.T
    weights = steady_weights(inner, coupling, one_by_one(frames, bases), strength)
    assert (weights == 0).any()
    assert left_to_gain(inner, coupling, strength, weights) < 1e-10


def test_a_basis_that_is_there_twice_changes_nothing(take):
    frames, bases = take
    twice = np.concatenate([bases, bases[:1], np.zeros((1, bases.shape[1]))])
    found = steady_weights(twice @ twice.T, frames @ twice.T, one_by_one(frames, twice), 2.0)
    alone = steady_weights(bases @ bases.T, frames @ bases.T, one_by_one(frames, bases), 2.0)
    assert found.min() >= 0
    np.testing.assert_allclose(found @ twice, alone @ bases, atol=1e-6)


def test_where_weights_can_be_one_thing_or_another_they_are_steady_and_not_rounding_s_choice() -> None:
    """Four bases, one the sum of two others less the third, but for rounding: on the target it may be anything."""
    rng = np.random.default_rng(1)
    t = np.linspace(0, 1, 60)[:, None]
    corners = rng.normal(size=(3, 80))
    bases = np.stack([*corners, corners[0] + corners[1] - 0.9 * corners[2]])
    frames = np.sin(np.pi * t * [1, 0.7, 1.3]) ** 2 @ corners + 0.05 * np.sin(2 * np.pi * t) * rng.normal(size=80)
    found = []
    for _ in range(2):
        noisy = frames * (1 + 1e-7 * rng.normal(size=frames.shape))
        found.append(
            [
                steady_weights(bases @ bases.T, noisy @ bases.T, one_by_one(noisy, bases), 2.0, bend=b)
                for b in (0.0, 1e-3)
            ]
        )
    (loose, steady), (other_loose, other_steady) = found
    assert np.abs(loose - other_loose).max() > 1e-2
    assert np.abs(steady - other_steady).max() < 1e-4
    assert np.abs(np.diff(steady, n=2, axis=0)).max() < 0.5 * np.abs(np.diff(loose, n=2, axis=0)).max()
    left = [np.linalg.norm(frames - weights @ bases) for weights in (loose, steady)]
    assert left[1] < 1.001 * left[0]


@pytest.mark.parametrize("n_frames", [3, 4])
def test_the_shortest_takes(n_frames: int) -> None:
    frames, bases = np.array([[0.0], [1.0], [-1.0], [0.5]])[:n_frames], np.ones((1, 1))
    found = steady_weights(bases @ bases.T, frames @ bases.T, np.maximum(frames, 0), 2.0)
    assert (found == 0).any()
    assert (found > 0).any()
    assert left_to_gain(bases @ bases.T, frames @ bases.T, 2.0, found) < 1e-12


def test_what_leaves_nothing_to_choose_stays_as_it_is(take):
    frames, bases = take
    alone = one_by_one(frames, bases)
    inner, coupling = bases @ bases.T, frames @ bases.T
    assert np.array_equal(steady_weights(inner, coupling, alone, 2.0, np.full(len(frames), True)), alone)
    assert np.array_equal(steady_weights(inner, coupling, alone, 0.0), alone)
    assert np.array_equal(steady_weights(inner, coupling[:2], alone[:2], 2.0), alone[:2])


def test_frames_at_rest_stay_at_rest(take):
    frames, bases = take[0].copy(), take[1]
    frames[:4] = 0
    alone = one_by_one(frames, bases)
    held = np.arange(len(frames)) < 4
    steady = steady_weights(bases @ bases.T, frames @ bases.T, alone, 1.0, held)
    assert not steady[:4].any()
    assert np.abs(steady - alone).max() > 1e-3
    # The same with the held frames' terms written out.
    bend = np.diff(np.eye(len(frames)), n=2, axis=0)
    time = np.eye(len(frames)) + bend.T @ bend
    slope = (time @ (steady @ bases - frames) @ bases.T)[4:]
    assert np.abs(np.minimum(steady[4:], slope)).max() < 1e-9
    still = frames.reshape(40, 30, 3)
    assert not select_bases(gram_matrix(still), 30, BasisParameters(threshold=0, count=3)).weights[:4].any()


def test_the_errors_are_those_of_the_steadied_weights(take):
    frames = take[0].reshape(40, 30, 3)
    chosen = select_bases(gram_matrix(frames), 30, BasisParameters(threshold=0, count=3))
    squared = ((np.einsum("tk,kvi->tvi", chosen.weights, frames[chosen.frames]) - frames) ** 2).sum(2).mean(1)
    np.testing.assert_allclose(chosen.frame_errors**2, squared, rtol=1e-6, atol=1e-12)
    assert chosen.errors[-1] == pytest.approx(np.sqrt(squared.mean()))
    alone = select_bases(gram_matrix(frames), 30, BasisParameters(threshold=0, count=3, steadiness=0))
    assert np.array_equal(chosen.frames, alone.frames)
    assert np.array_equal(alone.weights[alone.frames], np.eye(3))
    assert not np.array_equal(chosen.weights, alone.weights)
