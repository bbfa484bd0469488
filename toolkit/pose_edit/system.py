"""Linear systems of the weights step: a banded matrix, and the few rows of the constraints by Woodbury's formula."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from toolkit.banded import Bands, FrameRows

__all__ = ["SmallFactor", "System"]

Array = NDArray[np.float64]


class SmallFactor:
    """LU factors of a small matrix (R, R), by LAPACK itself: SciPy's own call takes longer than the work."""

    def __init__(self, matrix: Array) -> None:
        self._factors, self._pivots, failed = dgetrf(matrix)
        if failed:
            raise np.linalg.LinAlgError("the constraints' matrix is singular")

    def solve(self, right: Array) -> Array:
        """Solve for (R,)."""
        return np.asarray(dgetrs(self._factors, self._pivots, right)[0])


class System:
    """``P + diag(extra) + B^T M^-1 B``, ``P`` of ``bands``, ``B`` the ``rows``, ``M`` (R, R) the ``metric``.

    Of what is ``stuck`` (n, K) nothing moves if nothing pulls at it: its rows and columns are the identity's.
    """

    def __init__(
        self,
        bands: Bands,
        rows: FrameRows,
        metric: Array,
        extra: Array | None = None,
        stuck: NDArray[np.bool_] | None = None,
    ) -> None:
        self._rows = rows
        if stuck is not None:
            self._rows = FrameRows(rows.frames, np.where(stuck[rows.frames], 0.0, rows.local))
        self._factor = bands.factor(extra, stuck)
        self._small = SmallFactor(metric + self._factor.answers(self._rows))

    def solve(self, right: Array) -> Array:
        """Solve for one right-hand side (n, K)."""
        alone = self._factor.solve(right)
        pull = self._small.solve(self._rows.of(alone))
        return np.asarray(alone - self._factor.solve(self._rows.spread(pull, alone)))
