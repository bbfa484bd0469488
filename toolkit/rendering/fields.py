"""Scalar fields worth a colour map: motion, and the coating as in the paper's Figure 2c."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.decomposition import coating
from toolkit.mesh.geometry import vertex_normals
from toolkit.smoothing import SmoothingFilter
from toolkit.stabilisation import rigid_fits, stable_weights

__all__ = ["coating_fields", "motion_field"]

Array = NDArray[np.float64]


def motion_field(rest: Array, frame: NDArray[np.floating]) -> Array:
    """Distance ``(V,)`` that every vertex moved from ``rest`` (V, 3), in the mesh's unit, without the head's motion."""
    points = np.asarray(frame, dtype=np.float64)
    some = np.unique(np.linspace(0, len(rest) - 1, min(2000, len(rest))).astype(int))
    weights = stable_weights(rest[some], points[None, some])
    head = rigid_fits(rest[some], points[None, some], weights)
    still = rest @ head.rotations[0].T + head.translations[0]
    return np.linalg.norm(points - still, axis=1)


def coating_fields(
    frame: NDArray[np.floating], triangles: NDArray[np.integer], smoothing: SmoothingFilter
) -> tuple[Array, Array, Array]:
    """Return the smoothed shape ``(V, 3)``, the coating's length ``(V,)`` and its part along the normal ``(V,)``.

    The coating is ``L (S - S~)`` (Eq. 1). Along the normal it is positive on ridges and negative in furrows.
    """
    points = np.asarray(frame, dtype=np.float64)
    smooth = np.asarray(smoothing.smooth(points), dtype=np.float64)
    xi = coating(points, smooth, np.asarray(triangles))
    along = np.sum(xi * vertex_normals(smooth, np.asarray(triangles)), axis=1)
    return smooth, np.linalg.norm(xi, axis=1), along
