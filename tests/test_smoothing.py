from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import brentq
from scipy.sparse.csgraph import reverse_cuthill_mckee

from toolkit.errors import InputError
from toolkit.kernels import chebyshev_of_average
from toolkit.mesh import TriangleMesh
from toolkit.operators import smoothing_average
from toolkit.smoothing import (
    SmoothingFilter,
    SmoothingParameters,
    apply_steps,
    filter_coefficients,
    largest_eigenvalue,
    level_bounds,
    parameters_for_wavelength,
    smooth_with_pymeshlab,
)


@pytest.mark.parametrize("steps", [0, 1, 7, 40, 120])
def test_the_polynomial_is_the_filter(bump: TriangleMesh, steps: int) -> None:
    parameters = SmoothingParameters(steps=steps)
    quick = SmoothingFilter(bump.triangles, bump.n_vertices, parameters).smooth(bump.vertices)
    average = smoothing_average(bump.triangles, bump.n_vertices)
    slow = apply_steps(average, bump.vertices, steps, 0.5, -0.53)
    assert np.abs(quick - slow).max() < 1e-9 * bump.diagonal


@pytest.mark.parametrize("passes", [0, 1, 60])
def test_averaging_is_so_many_passes(bump: TriangleMesh, passes: int) -> None:
    average = smoothing_average(bump.triangles, bump.n_vertices)
    slow = bump.vertices
    for _ in range(passes):
        slow = (slow + average @ slow) / 2
    quick = SmoothingFilter(bump.triangles, bump.n_vertices, SmoothingParameters()).average(bump.vertices, passes)
    assert np.abs(quick - slow).max() < 1e-10 * bump.diagonal


def test_it_takes_a_third_of_the_passes() -> None:
    parameters = SmoothingParameters()
    triangles = np.array([[0, 1, 2]])
    assert len(SmoothingFilter(triangles, 3, parameters).coefficients) < 30


def test_equals_pymeshlab_on_every_vertex(bump: TriangleMesh) -> None:
    parameters = SmoothingParameters()
    ours = SmoothingFilter(bump.triangles, bump.n_vertices, parameters).smooth(bump.vertices)
    theirs = smooth_with_pymeshlab(bump, parameters)
    assert np.abs(ours - theirs).max() < 1e-6 * bump.diagonal
    assert np.abs(ours - bump.vertices).max() > 1e-3


def test_blocks_in_single_precision(bump: TriangleMesh, take: np.ndarray) -> None:
    smoother = SmoothingFilter(bump.triangles, bump.n_vertices, SmoothingParameters())
    deltas = np.moveaxis(take - bump.vertices, 0, 2)[smoother.order]
    block = smoother.smooth_block(np.ascontiguousarray(deltas, dtype=np.float32))
    exact = smoother.smooth_block(np.ascontiguousarray(deltas))
    assert np.abs(block - exact).max() < 1e-6 * np.abs(deltas).max()


@pytest.fixture
def rows(bump: TriangleMesh) -> sp.csr_matrix:
    """The averages of two bumps, which have borders, and of a vertex alone."""
    n = bump.n_vertices
    average = smoothing_average(np.concatenate([bump.triangles, bump.triangles + n]), 2 * n + 1)
    order = reverse_cuthill_mckee(average)
    return average[order][:, order].tocsr()


@pytest.mark.parametrize("columns", [1, 21, 48])
def test_passes_taken_together_are_the_same_passes(rows: sp.csr_matrix, columns: int) -> None:
    """To the bit: a row that is read too early or too late would show."""
    n = rows.shape[0]
    share, own = (1 / np.diff(rows.indptr)).astype(np.float32), np.float32(0.3)
    block = np.random.default_rng(2).normal(size=(n, columns)).astype(np.float32)
    coefficients = (0.8 ** np.arange(20)).astype(np.float32)
    shares = np.stack([share, 2 * share])
    graph = rows.indptr.astype(np.uint32), rows.indices.astype(np.uint32), shares, own, coefficients
    together, one_by_one, spare = np.empty_like(block), np.empty_like(block), np.empty_like(block)
    chebyshev_of_average(*graph, np.array([0, n]), 1, block, one_by_one, spare)
    bounds = level_bounds(rows)
    assert len(bounds) > 40
    for depth in (2, 7, 19, 40):
        chebyshev_of_average(*graph, bounds, depth, block, together, spare)
        assert np.array_equal(together, one_by_one)


def test_levels_have_to_do_with_those_beside_them_only(rows: sp.csr_matrix) -> None:
    """Also where a vertex sees one of the border that does not see it: the middle of a fan."""
    middle_sees_first = sp.lil_matrix(np.eye(7) + np.eye(7, k=1) + np.eye(7, k=-1))
    middle_sees_first[5, 0] = 1
    for graph in (rows, middle_sees_first.tocsr()):
        bounds = level_bounds(graph)
        assert bounds[0] == 0
        assert bounds[-1] == graph.shape[0]
        assert (np.diff(bounds) > 0).all()
        pairs = graph.tocoo()
        apart = np.searchsorted(bounds, pairs.row, "right") - np.searchsorted(bounds, pairs.col, "right")
        assert np.abs(apart).max() == 1


def test_the_eigenvalues_are_where_the_polynomial_is_fitted(bump: TriangleMesh) -> None:
    """With a border, closed, with edges of three triangles, with borders that touch, and on the border only."""
    tetrahedron = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    fin, tie = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]]), np.array([[0, 1, 2], [0, 3, 4]])
    surfaces, others = (bump.triangles, tetrahedron, tie[:1]), (fin, tie)
    for triangles, bound in [(t, 1.5) for t in surfaces] + [(t, 2.0) for t in others]:
        average = smoothing_average(triangles, int(triangles.max()) + 1).toarray()
        eigenvalues = np.linalg.eigvals(np.eye(len(average)) - average)
        assert largest_eigenvalue(triangles) == bound
        assert eigenvalues.real.max() <= bound + 1e-9
        assert np.abs(eigenvalues.imag).max() < 1e-6


@pytest.mark.parametrize("wavelength", [0.6, 1.2, 2.4])
def test_wavelength_halves_a_wave(wavelength: float) -> None:
    n = 160
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    edge = 0.1
    xy = np.stack([edge * (i + 0.5 * j).ravel(), edge * np.sqrt(3) / 2 * j.ravel()], axis=1)
    a = (i[:-1, :-1] * n + j[:-1, :-1]).ravel()
    triangles = np.concatenate([np.stack([a, a + n, a + 1], 1), np.stack([a + n, a + n + 1, a + 1], 1)])
    parameters = parameters_for_wavelength(wavelength, edge)
    wave = np.cos(2 * np.pi * xy[:, 0] / wavelength)[:, None]
    smooth = SmoothingFilter(triangles, n * n, parameters).smooth(wave)
    inner = (xy[:, 0] > 8) & (xy[:, 0] < 8 + 2.4) & (xy[:, 1] > 5) & (xy[:, 1] < 8)
    ratio = (smooth[inner] * wave[inner]).sum() / (wave[inner] ** 2).sum()
    assert ratio == pytest.approx(0.5, abs=0.03)


def test_bad_parameters_are_named(bump: TriangleMesh) -> None:
    with pytest.raises(InputError, match=r"mu = 0\.2"):
        SmoothingParameters(mu=0.2)
    with pytest.raises(InputError, match="longer than the face"):
        SmoothingParameters(wavelength=1e6).resolved(bump)
    with pytest.raises(InputError, match="two edges"):
        parameters_for_wavelength(0.1, 0.2)


def test_the_paper_s_strength_is_a_wavelength() -> None:
    """Forty steps of (0.5, -0.53) halve the wave whose eigenvalue solves ((1 - k/2)(1 + 0.53 k))^40 = 1/2."""
    eigenvalue = brentq(lambda k: ((1 - 0.5 * k) * (1 + 0.53 * k)) ** 40 - 0.5, 0.15, 0.9)
    turn = brentq(lambda a: 1 - (np.cos(a) + 2 * np.cos(a / 2)) / 3 - eigenvalue, 0.1, 2)
    parameters = parameters_for_wavelength(2 * np.pi / turn, 1.0)
    assert parameters.steps == pytest.approx(40, abs=1)
    assert parameters.mu == pytest.approx(-0.53, abs=0.001)


def test_steps_that_amplify_without_end_are_refused_instead_of_filling_the_memory() -> None:
    with pytest.raises(InputError, match="shorter wavelength"):
        filter_coefficients(20_000, 0.5, -0.53)
