"""The bases' side of an edit, exact and at full resolution, without a new factorisation (method, section 6).

With the weights given, the edit ``delta`` of the bases minimises, up to a constant (``b'`` minimises ``E_b`` itself),

    lambda_b sum_k delta_k^T A delta_k + lambda_e sum_a omega_a |c_a sum_k w_(t_a) k delta_k - r_a|^2.

The normal matrix is ``I_K (x) A`` and one rank-1 term for each row. By Woodbury's formula
``delta_k = (1 / lambda_b) sum_a w_(t_a) k A^-1 c_a^T y_a`` with ``M y = r``,
``M = diag(1 / (lambda_e omega)) + (W W^T o C A^-1 C^T) / lambda_b``: one back-substitution for each constrained vertex,
once, and a dense system as small as the constraints are few.

``A`` is of second order, so the exact answer to a pull at one vertex is a tent with a spike on it: on a mesh of 20,000
vertices the first ring follows by 84 %. With a handle's radius the pull acts on a small disc instead: the answer is
sought among the responses ``A^-1 f`` to pulls ``f`` on such discs, still meets the goal at the vertex itself, and is
smooth there (97 % with a disc of three edges). Radius 0 is the paper's.

``A`` knows gradients only, and is held by what the take never moves: a pull at an eyelid moves the far side of the face
by 40 % of it. With a reach ``l``, ``A`` becomes ``A + D / l^2``, ``D`` a third of the number of triangles at each
vertex (``A`` counts triangles alike, too): displacements themselves cost, and the answer fades as
``exp(-distance / l)``. That needs a factor of its own, made once. Reach 0 is the paper's, on the transfer's factor.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.pose_edit.handles import Handles
from toolkit.pose_edit.take import TransferSystem
from toolkit.solve import Factor, factorise

__all__ = ["Responses", "bases_metric"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

_MOST_KEPT = 512


class Responses:
    """``Z = A^-1 F``: how the whole face follows pulls at some vertices; columns are kept for the next solve.

    ``held`` vertices do not follow: their rows and columns are struck from ``A``, which is factorised anew, once for
    each set of held vertices. The system is smaller then, so every substitution is quicker. ``screening`` (V,) is what
    the reach adds to the diagonal of ``A``, None nothing.
    """

    def __init__(self, system: TransferSystem, held: Ids, handles: Handles, screening: Array | None = None) -> None:
        self.held, self.handles = held, handles
        n_vertices = system.matrix.shape[0]
        self._n_vertices = n_vertices
        self._free = np.setdiff1d(np.arange(n_vertices), held)
        self._factor: Factor
        if screening is None and not len(held):
            self._factor = system.factor
        elif len(self._free):
            matrix = system.matrix if screening is None else system.matrix + sp.diags(screening)
            self._factor = factorise(matrix.tocsr()[self._free][:, self._free] if len(held) else matrix)
        self._columns: dict[int, Array] = {}
        self._last: tuple[Ids, Array] = (np.zeros(0, dtype=np.int64), np.zeros((n_vertices, 0)))

    def __call__(self, vertices: Ids) -> Array:
        """``Z`` (V, U) for some vertices (U,); zero columns for held ones.

        With handles, ``Z G^-1 X^T``: ``X = E Z`` what each pull does at the vertices, ``G = F^T Z`` what it costs.
        """
        if np.array_equal(vertices, self._last[0]):
            return self._last[1]
        missing = [int(v) for v in vertices if int(v) not in self._columns]
        if len(self._columns) + len(missing) > _MOST_KEPT:
            self._columns.clear()
            missing = [int(v) for v in vertices]
        if missing:
            solved = self._solve(np.array(missing, dtype=np.int64))
            self._columns.update({v: solved[:, j] for j, v in enumerate(missing)})
        columns = np.empty((self._n_vertices, len(vertices)))
        for j, v in enumerate(vertices):
            columns[:, j] = self._columns[int(v)]
        if self.handles.radius > 0:
            cost = self.handles.pulls(vertices).T @ columns
            columns = columns @ (np.linalg.pinv(cost, rcond=1e-12, hermitian=True) @ columns[vertices].T)
        self._last = (np.array(vertices), columns)
        return columns

    def _solve(self, vertices: Ids) -> Array:
        right = self.handles.pulls(vertices).toarray()
        if not len(self.held):
            return self._factor.solve(right)
        result = np.zeros_like(right)
        if len(self._free):
            result[self._free] = self._factor.solve(right[self._free])
        return result


def bases_metric(weights_at: Array, coupling: Array, row_weights: Array, lambda_b: float, lambda_e: float) -> Array:
    """``M`` (R, R) of the rows; ``weights_at`` (R, K) the weights of each row's frame, ``coupling`` = C Z (R, R)."""
    return np.diag(1 / (lambda_e * row_weights)) + (weights_at @ weights_at.T) * coupling / lambda_b
