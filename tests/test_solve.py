from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from toolkit.mesh import TriangleMesh
from toolkit.mesh.topology import vertex_adjacency
from toolkit.operators import uniform_laplacian
from toolkit.solve import PulledSolve, SingularMatrixError, factorise


def _system(mesh: TriangleMesh) -> sp.csc_matrix:
    rows = uniform_laplacian(mesh.triangles, mesh.n_vertices)
    return sp.csc_matrix(rows.T @ rows + 1e-3 * sp.identity(mesh.n_vertices))


@pytest.mark.parametrize("columns", [0, 1, 3, 128, 129, 300])
def test_as_a_dense_solve(bump: TriangleMesh, columns: int) -> None:
    matrix = _system(bump)
    right = np.random.default_rng(1).normal(size=(bump.n_vertices, columns))
    dense = np.linalg.solve(matrix.toarray(), right)
    assert np.allclose(factorise(matrix).solve(right), dense, rtol=1e-8, atol=1e-8 * np.abs(dense).max(initial=1))


def test_one_right_hand_side_keeps_its_shape(bump: TriangleMesh) -> None:
    matrix = _system(bump)
    x = np.linspace(0, 1, bump.n_vertices)
    solved = factorise(matrix).solve(matrix @ x)
    assert solved.shape == x.shape
    assert np.abs(solved - x).max() < 1e-9


@pytest.mark.parametrize("columns", [2, 16, 37])
def test_pulls_found_on_the_way_are_those_given_at_once(bump: TriangleMesh, columns: int) -> None:
    matrix, rng = _system(bump), np.random.default_rng(2)
    right, unknowns = rng.normal(size=(bump.n_vertices, columns)), np.array([400, 7, 8, 390, 743])
    factor = factorise(matrix)
    solving = PulledSolve(factor, right, unknowns)
    for _ in range(2):
        pulls = rng.normal(size=(len(unknowns), columns))
        pulled = right.copy()
        pulled[unknowns] += pulls
        at_once = factor.solve(pulled)
        assert np.abs(solving.at_unknowns(pulls) - at_once[unknowns]).max() < 1e-10 * np.abs(at_once).max()
    assert np.abs(solving.everywhere(pulls) - at_once).max() < 1e-10 * np.abs(at_once).max()


def test_a_floating_part_is_refused(bump: TriangleMesh) -> None:
    """A Laplacian without a gauge leaves a constant free."""
    n = bump.n_vertices
    adjacency = vertex_adjacency(bump.triangles, n)
    floating = sp.diags(np.asarray(adjacency.sum(axis=1)).ravel()) - adjacency
    held = sp.block_diag([floating + sp.identity(n), floating + sp.csr_matrix(([1e-6], ([3], [3])), shape=(n, n))])
    factorise(held)
    for scale in (1, 1 / 3, 1e6):  # zero but for the rounding that each has of its own
        with pytest.raises(SingularMatrixError, match=f"{2 * n} x {2 * n}"):
            factorise(sp.block_diag([floating + sp.identity(n), scale * floating]))
    path = sp.diags([[-1.0] * 9, [1.0, *[2.0] * 8, 1.0], [-1.0] * 9], [-1, 0, 1])
    with pytest.raises(SingularMatrixError, match="10 x 10"):
        factorise(sp.block_diag([path]))
    with pytest.raises(SingularMatrixError):
        factorise(sp.csc_matrix((5, 5)))


def test_shapes_are_checked(bump: TriangleMesh) -> None:
    with pytest.raises(ValueError, match="square"):
        factorise(sp.csc_matrix((3, 4)))
    with pytest.raises(ValueError, match="5 rows"):
        factorise(_system(bump)).solve(np.zeros(5))
