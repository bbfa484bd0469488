"""The edit of one key frame carried through its window by least squares in space and time (the paper's Eqs. 18-21).

For the change ``x = D' - D`` of the details, ``D`` the automatic result, E the change asked for at the key frame:

    min_x  key |x_tk - E|^2 + gradient (sum_t |x_t+1 - x_t|^2 + sum_t x_t^T L x_t) + ends (|x_ts|^2 + |x_te|^2)

``L`` is the graph Laplacian of the region's edges, those to its unedited surroundings included. The normal matrix is
``M (x) I + gradient I (x) L`` with M (m, m) tridiagonal. ``M = Q diag(s) Q^T`` leaves m systems
``(s_i I + gradient L) y_i = key Q[k, i] E``, all with one right-hand side: every one of them has its solution in the
Krylov space of E, so that one Lanczos run solves them all, ``x_t = sum_i Q[t, i] y_i``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import eigh_tridiagonal, solveh_banded

from toolkit.detail_edit.krylov import lanczos_steps
from toolkit.mesh.topology import unique_edges

__all__ = ["GradientWeights", "propagated", "region_laplacian", "time_matrix"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

_TOLERANCE = 1e-11
_STEPS = 40
_ROOM = 320
_MOST_STEPS = 4000


@dataclass(frozen=True)
class GradientWeights:
    """The paper's weights: ``key`` lambda_e, ``gradient`` lambda_t and ``ends`` lambda_s."""

    key: float = 1.0
    gradient: float = 0.1
    ends: float = 1.0


def time_matrix(window: tuple[int, int], frame: int, weights: GradientWeights) -> tuple[Array, Array]:
    """Diagonal ``(m,)`` and off-diagonal ``(m - 1,)`` of M."""
    m = window[1] - window[0] + 1
    diagonal = np.zeros(m)
    diagonal[:-1] += weights.gradient
    diagonal[1:] += weights.gradient
    diagonal[frame - window[0]] += weights.key
    diagonal[0] += weights.ends
    diagonal[-1] += weights.ends
    return diagonal, np.full(m - 1, -weights.gradient)


def region_laplacian(triangles: NDArray[np.integer], vertices: Ids) -> sp.csr_matrix:
    """Graph Laplacian ``(n, n)`` of the vertices (n,) with all their edges, held to 0 where one leaves the region.

    ``triangles`` (f, 3) must hold all triangles at the vertices.
    """
    edges = unique_edges(triangles)
    found = np.minimum(np.searchsorted(vertices, edges), len(vertices) - 1)
    inside = vertices[found] == edges
    n = len(vertices)
    i, j = found[inside.all(axis=1)].T
    joined = sp.coo_matrix((np.ones(2 * len(i)), (np.r_[i, j], np.r_[j, i])), (n, n))
    return sp.csr_matrix(sp.diags(np.bincount(found[inside], minlength=n).astype(float)) - joined)


def propagated(
    laplacian: sp.csr_matrix, asked: Array, window: tuple[int, int], frame: int, weights: GradientWeights
) -> Array:
    """Change ``(m, n, 3)`` of every frame of the window from the one ``asked`` (n, 3) for at the key frame."""
    shifts, modes = eigh_tridiagonal(*time_matrix(window, frame, weights))
    matrix = sp.csr_matrix(weights.gradient * laplacian)
    right = weights.key * modes[frame - window[0]]
    basis, diagonals, subdiagonals = _lanczos(matrix, asked, float(shifts[0]))
    changes = np.empty((len(shifts), *asked.shape))
    for c, length in enumerate(np.linalg.norm(asked, axis=0)):
        # (T + s I)^-1 e_1 for every shift, by the eigenvectors of T; then from modes to frames.
        values, vectors = eigh_tridiagonal(diagonals[c], subdiagonals[c])
        spread = (right[:, None] * length * vectors[0]) / (shifts[:, None] + values)
        changes[:, :, c] = (modes @ spread @ vectors.T) @ basis[c]
    return changes


def _lanczos(matrix: sp.csr_matrix, start: Array, smallest: float) -> tuple[Array, Array, Array]:
    """Lanczos basis ``(3, j, n)`` from each column of ``start`` (n, 3), with its tridiagonal matrices.

    As many steps as the hardest system, the one of the ``smallest`` shift, takes to a residual of 1e-11. Lost
    orthogonality does no harm to solutions of linear systems: it only takes some steps more, as in conjugate gradients.
    """
    basis, alphas, betas = np.empty((3, _ROOM + 1, len(start))), np.empty((3, _ROOM)), np.empty((3, _ROOM))
    basis[:, 0] = (start / np.maximum(np.linalg.norm(start, axis=0), 1e-300)).T
    for done in range(0, _MOST_STEPS, _STEPS):
        steps = done + _STEPS
        if steps > alphas.shape[1]:
            basis, alphas, betas = (_longer(x) for x in (basis, alphas, betas))
        lanczos_steps(matrix.indptr, matrix.indices, matrix.data, basis, alphas, betas, done, steps)
        if _residual(alphas[:, :steps], betas[:, :steps], smallest) < _TOLERANCE:
            break
    return basis[:, :steps], alphas[:, :steps], betas[:, : steps - 1]


def _longer(values: Array) -> Array:
    """The same with room for twice as many steps (axis 1); memory that is not written to costs nothing."""
    longer = np.empty((3, 2 * values.shape[1], *values.shape[2:]))
    longer[:, : values.shape[1]] = values
    return longer


def _residual(alphas: Array, betas: Array, shift: float) -> float:
    """Largest residual of ``(T + shift I) y = e_1`` over the columns, as the Lanczos relation gives it."""
    unit = np.zeros(alphas.shape[1])
    unit[0] = 1
    solved = [solveh_banded(np.stack([a + shift, b]), unit, lower=True) for a, b in zip(alphas, betas, strict=True)]
    return max(float(abs(b[-1] * y[-1])) for b, y in zip(betas, solved, strict=True))
