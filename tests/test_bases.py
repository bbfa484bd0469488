from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import nnls

from toolkit.bases import BasisParameters, gram_matrix, non_negative_weights, select_bases
from toolkit.errors import InputError


def _take(n_frames: int = 60, n_vertices: int = 200, rank: int = 5, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    shapes = rng.normal(size=(rank, n_vertices, 3))
    weights = rng.uniform(size=(n_frames, rank)) * (rng.uniform(size=(n_frames, rank)) < 0.6)
    weights[0] = 0
    weights[7] = [0, 1, 0, 0, 0]
    return np.einsum("tk,kvi->tvi", weights, shapes)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("warm", [False, True])
def test_weights_equal_scipy(seed: int, warm: bool) -> None:
    rng = np.random.default_rng(seed)
    bases = rng.normal(size=(50, 8))
    bases[:, 7] = bases[:, 6] + 1e-4 * rng.normal(size=50)
    frames = rng.normal(size=(30, 50))
    start = np.maximum(rng.normal(size=(30, 8)), 0) if warm else None
    ours = non_negative_weights(bases.T @ bases, frames @ bases, start)
    for t in range(30):
        residual = nnls(bases, frames[t])[1]
        assert ours[t].min() >= 0
        assert np.linalg.norm(bases @ ours[t] - frames[t]) == pytest.approx(residual, rel=1e-9)


def test_gram_sees_every_column() -> None:
    deltas = _take(20, 9000).astype(np.float32)
    exact = deltas.reshape(20, -1).astype(float) @ deltas.reshape(20, -1).T.astype(float)
    assert np.abs(gram_matrix(deltas) - exact).max() < 1e-6 * exact.max()


def test_errors_are_those_of_the_frames() -> None:
    take = _take() + 0.05 * np.random.default_rng(2).normal(size=(60, 200, 3))
    chosen = select_bases(gram_matrix(take), 200, BasisParameters(threshold=0, count=4))
    fitted = np.einsum("tk,kvi->tvi", chosen.weights, take[chosen.frames])
    squared = ((fitted - take) ** 2).sum(axis=2).mean(axis=1)
    assert len(chosen.frames) == 4
    assert np.allclose(chosen.frame_errors**2, squared, rtol=1e-6)
    assert chosen.errors[-1] == pytest.approx(np.sqrt(squared.mean()))
    assert (np.diff(chosen.errors) < 0).all()
    assert chosen.weights.min() >= 0


def test_greedy_picks_the_best_first_frame() -> None:
    """Slow oracle: try every frame as the only basis."""
    take = _take(30)
    chosen = select_bases(gram_matrix(take), 200, BasisParameters(threshold=0, count=1))
    flat = take.reshape(30, -1)
    best = min(
        range(1, 30),
        key=lambda c: sum(nnls(flat[c][:, None], x)[1] ** 2 for x in flat),
    )
    assert chosen.frames[0] == best


def test_threshold_zero_keeps_what_adds_something() -> None:
    take = _take(25)
    chosen = select_bases(gram_matrix(take), 200, BasisParameters(threshold=0))
    fitted = np.einsum("tk,kvi->tvi", chosen.weights, take[chosen.frames])
    assert np.abs(fitted - take).max() < 1e-6


def test_threshold_as_length_and_share() -> None:
    take = _take()
    gram = gram_matrix(take)
    share = select_bases(gram, 200, BasisParameters(threshold=0.3))
    assert share.errors[-1] <= 0.3 * share.errors[0] < share.errors[-2]
    length = select_bases(gram, 200, BasisParameters(threshold=0, threshold_length=0.5))
    assert length.errors[-1] <= 0.5 < length.errors[-2]


def test_gaps_count_in_the_fit() -> None:
    """A blink moves few vertices; with its gaps in the fit the first bases know it."""
    take = 0.2 * _take(40)
    gaps = np.zeros((40, 10, 3))
    gaps[20:25, :, 1] = -np.hanning(7)[1:-1][:, None]
    take[20:25, :2, 1] -= gaps[20:25, :2, 1] * 0.1
    gram = gram_matrix(take)
    fits = []
    for share in (0.0, 1.0):
        chosen = select_bases(gram, 200, BasisParameters(threshold=0, count=3, contact_share=share), gaps)
        fits.append(np.abs(np.einsum("tk,kpi->tpi", chosen.weights, gaps[chosen.frames]) - gaps).max())
    assert fits[1] < 0.2 * fits[0]


def test_a_still_take_needs_no_basis() -> None:
    chosen = select_bases(gram_matrix(np.zeros((12, 30, 3))), 30)
    assert chosen.weights.shape == (12, 0)
    assert chosen.errors.tolist() == [0]


def test_bad_parameters() -> None:
    with pytest.raises(InputError, match="count = 0"):
        BasisParameters(count=0)
    with pytest.raises(InputError, match=r"contact_share = -1\.0"):
        BasisParameters(contact_share=-1.0)
