"""Which way faces look: agreement between neighbours, and outside against inside."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from toolkit.checks.edges import EdgeTable
from toolkit.checks.measures import part_volumes
from toolkit.mesh.geometry import triangle_areas

__all__ = ["coherent_flips", "enclosed_volumes", "is_inside_out"]

_ROUND_ENOUGH = 1e-3
"""Least isoperimetric quotient 36 pi V^2 / A^3 (a ball has 1, a plane 0) at which in and out can be told apart."""


def coherent_flips(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer], table: EdgeTable
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which triangles to turn so that neighbours agree, ``(F,)``, and which lie on a one-sided surface, ``(F,)``.

    Every face has two states. Neighbours that agree join their equal states, others their opposite ones, and the
    connected parts of these 2F nodes are the coherent orientations: of a part's two, the one that turns less area is
    taken. On a one-sided surface (a Moebius strip) the two are the same part; there nothing is turned.
    """
    n = len(triangles)
    a, b, agree = table.neighbour_faces()
    if agree.all():
        return np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    rows = np.concatenate([a, a + n])
    cols = np.concatenate([np.where(agree, b, b + n), np.where(agree, b + n, b)])
    graph = sp.csr_matrix((np.ones(len(rows), dtype=np.int8), (rows, cols)), shape=(2 * n, 2 * n))
    count, labels = connected_components(graph, directed=False)
    as_is, turned = labels[:n], labels[n:]
    kept_area = np.bincount(as_is, weights=triangle_areas(vertices, triangles), minlength=count)
    # Equal areas: the lower label, so that exactly one of the two orientations is chosen.
    less = kept_area[as_is] < kept_area[turned]
    flips = less | ((kept_area[as_is] == kept_area[turned]) & (as_is > turned))
    return flips, as_is == turned


def enclosed_volumes(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer], table: EdgeTable
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Signed volume and area of every connected part, ``(parts,)`` each, in order of `EdgeTable.parts`.

    Each border loop is closed by a fan round its middle, so a mask and a head without a neck have a volume too:
    positive where the faces look outwards, to the bulging side.
    """
    parts = table.parts
    count = int(parts.max(initial=-1)) + 1
    middles = _means(vertices, parts, count)
    volume, area = part_volumes(vertices, triangles, parts, middles)

    up = table.balance[table.counts == 1] > 0
    start, end = np.where(up[:, None], table.border, table.border[:, ::-1]).T
    if len(start):
        starts, ends = (vertices[ids] - middles[parts[ids]] for ids in (start, end))
        border = sp.csr_matrix((np.ones(len(start)), (start, end)), shape=(len(vertices), len(vertices)))
        loop = connected_components(border, directed=False)[1]
        centre = _means(starts, loop[start], int(loop.max()) + 1)[loop[start]]
        fans = np.einsum("ij,ij->i", ends, np.cross(starts, centre)) / 6
        volume = volume + np.bincount(parts[start], weights=fans, minlength=count)
    return volume, area


def is_inside_out(vertices: NDArray[np.float64], triangles: NDArray[np.integer], table: EdgeTable) -> bool:
    """Whether the largest part's faces look inwards; False where that cannot be told (a flat patch).

    The largest part decides for all: a mouth bag or an eye socket that is a part of its own rightly looks inwards.
    """
    volume, area = enclosed_volumes(vertices, triangles, table)
    if area.max(initial=0.0) <= 0:
        return False
    largest = int(np.argmax(area))
    quotient = 36 * np.pi * volume[largest] ** 2 / area[largest] ** 3
    return bool(quotient > _ROUND_ENOUGH and volume[largest] < 0)


def _means(points: NDArray[np.float64], groups: NDArray[np.integer], count: int) -> NDArray[np.float64]:
    sums = np.stack([np.bincount(groups, weights=points[:, k], minlength=count) for k in range(3)], axis=1)
    return sums / np.maximum(np.bincount(groups, minlength=count), 1)[:, None]
