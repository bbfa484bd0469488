"""Guide lines: what an artist draws on both faces beyond lids and lips, for the registration alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from data.layout import Layout, hand_made
from toolkit.feature_lines import EdgePaths, FeatureLine
from toolkit.mesh import TriangleMesh

__all__ = ["guide_lines", "guide_stops"]

Array = NDArray[np.float64]

_APART = 0.03
"""Picks on the target are this share of the face's height apart, about half a centimetre."""


def guide_stops(layout: Layout, level: int) -> dict[str, list[int]]:
    """Vertices of the performer through which each guide leads, after ``level`` rounds; both sides, the midline once.

    ``samples/guides.json`` names the landmarks on the way, and for the folds of the lids which ring round the eye.
    """
    given, names, stops = hand_made("guides"), layout.landmarks, {}
    for guide, words in given["through"].items():
        for side in ("l", "r") if any(word not in names for word in words) else ("",):
            ids = [names[word] if word in names else names[f"{word}_{side}"] for word in words]
            stops[f"{guide}_{side}".rstrip("_")] = ids
    for guide, place in given["lids"].items():
        for side in ("left", "right"):
            arc, rings = layout.arcs[f"eyelid_{side}_{place['arc']}"], layout.rings[f"eye_{side}"]
            rim = next(ring for ring in rings if set(arc) <= set(ring))
            beside = [rings[place["ring"]][rim.index(vertex)] for vertex in arc[1:-1]]
            stops[f"{guide}_{side[0]}"] = layout.subdivision.refine_path(beside, level)
    return stops


def guide_lines(
    source: TriangleMesh, target: TriangleMesh, truth: Array, stops: dict[str, list[int]], height: float
) -> list[FeatureLine]:
    """Guides through source vertices ``stops[name]``, and vertices near their true places picked on the target.

    The source's line runs along edges. On the target every pick is the vertex nearest to the true point, ``truth``
    (V, 3), as a careful user picks it, and is off by up to half an edge like any other.
    """
    paths, tree, lines = EdgePaths(source.vertices, source.triangles), cKDTree(target.vertices), []
    for name, through in stops.items():
        path = paths.through(through, False)
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(truth[path], axis=0), axis=1))])
        count = max(2, round(along[-1] / (_APART * height)) + 1)
        spread = np.unique(np.searchsorted(along, np.linspace(0, along[-1], count)).clip(0, len(path) - 1))
        near = tree.query(truth[path[spread]])[1]
        picked = near[np.sort(np.unique(near, return_index=True)[1])].astype(np.int64)
        if len(picked) > 1:
            lines.append(FeatureLine(name, False, path, picked, guide=True))
    return lines
