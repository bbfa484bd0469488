"""The coating's magnitude of a displayed face (the paper's Figure 2c)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.mesh import TriangleMesh
from toolkit.rendering.fields import coating_fields
from toolkit.smoothing import SmoothingFilter, SmoothingParameters

__all__ = ["Coating"]


class Coating:
    """Measures the coating; keeps the filter of a connectivity."""

    def __init__(self, parameters: SmoothingParameters) -> None:
        self._parameters = parameters
        self._triangles: NDArray[np.integer] | None = None
        self._filter: SmoothingFilter | None = None

    def measure(self, vertices: NDArray[np.floating], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
        """``|L (S - S~)|`` of every vertex, ``(V,)``, in the mesh's unit."""
        if self._filter is None or self._triangles is not triangles:
            mesh = TriangleMesh(np.asarray(vertices, dtype=np.float64), triangles)
            self._filter = SmoothingFilter(triangles, len(vertices), self._parameters.resolved(mesh))
            self._triangles = triangles
        return np.asarray(coating_fields(vertices, triangles, self._filter)[1], dtype=np.float32)
