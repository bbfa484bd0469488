"""From a file's faces to triangles: the same steps for every format."""

from __future__ import annotations

import logging
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import Polygons, TriangleMesh

__all__ = ["build_mesh"]

logger = logging.getLogger(__name__)


def build_mesh(
    vertices: NDArray[np.floating],
    counts: NDArray[np.integer],
    indices: NDArray[np.integer],
    *,
    where: object,
    locate: Callable[[int], str] | None = None,
) -> TriangleMesh:
    """Make the mesh of vertices ``(V, 3)`` and faces given by corner ``counts`` (P,) and vertex ``indices`` (sum,).

    Faces that are not all triangles are kept as ``polygons`` and split by ``Polygons.triangulate``. A "face" of one
    or two corners has no surface: it is left out, and the log says so. ``locate(face)`` names a face for messages.

    Raises
    ------
    InputError : no vertices, or a face names a vertex that the file does not have
    """
    if len(vertices) == 0:
        raise InputError("the file holds no vertices", where=where, remedy="export the mesh again, with its geometry")
    _check_range(counts, indices, len(vertices), where, locate)
    too_few = counts < 3
    if too_few.any():
        logger.warning("%s: left out %d faces with fewer than three corners", where, np.count_nonzero(too_few))
        counts, indices = counts[~too_few], indices[~np.repeat(too_few, counts)]
    polygons = Polygons(counts.astype(np.int32), indices.astype(np.int32))
    positions = np.ascontiguousarray(vertices, dtype=np.float64)
    if (counts == 3).all():
        return TriangleMesh(positions, polygons.indices.reshape(-1, 3))
    return TriangleMesh(positions, polygons.triangulate(), polygons)


def _check_range(
    counts: NDArray[np.integer],
    indices: NDArray[np.integer],
    n_vertices: int,
    where: object,
    locate: Callable[[int], str] | None,
) -> None:
    wrong = np.flatnonzero((indices < 0) | (indices >= n_vertices))
    if len(wrong) == 0:
        return
    face = int(np.searchsorted(np.cumsum(counts), wrong[0], side="right"))
    name = locate(face) if locate else f"face {face}"
    raise InputError(
        f"{name} uses vertex {indices[wrong[0]]} (counted from 0), but there are {n_vertices} vertices",
        where=where,
        remedy="the file is damaged or cut short, export it again",
    )
