"""Lines beyond lids and lips that an artist draws on both faces: they follow what can be seen or felt on any head."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.feature_lines import FeatureLine, shortest_edge_path
from toolkit.mesh import TriangleMesh

__all__ = ["GUIDES", "guide_lines", "ict_stops", "sample_stops"]

Array = NDArray[np.float64]

GUIDES = {
    "midline_upper": "forehead_high forehead_mid forehead_low nasion nose_bridge nose_tip subnasale philtrum "
    "lip_upper_outer_mid",
    "midline_lower": "lip_lower_outer_mid labiomental pogonion menton",
    "brow": "brow_inner brow_mid brow_outer",
    "nose_wing": "subnasale nose_ala_base nose_ala",
    "nasolabial_fold": "nose_ala nasolabial mouth_corner_outer",
    "corner_to_chin": "mouth_corner_outer chin_side",
    "jaw": "menton jaw_front jaw_mid jaw_gonion ear_lobe",
    "cheekbone": "tragus cheek_bone under_eye nose_side",
    "temporal": "brow_outer temple forehead_side forehead_high",
    "corner_to_ear": "mouth_corner_outer cheek_mid ear_lobe",
}
"""Name to landmarks in order; those of one side stand for both sides."""
_APART = 0.03
"""Picks on the target are this share of the face's height apart, about half a centimetre."""


def guide_lines(
    source: TriangleMesh, target: TriangleMesh, truth: Array, stops: dict[str, list[int]], height: float
) -> list[FeatureLine]:
    """Lines through source vertices ``stops[name]``, and vertices near their true places picked on the target.

    The source's line runs along edges. On the target every pick is the vertex nearest to the true point, as a careful
    user picks it, and is off by up to half an edge like any other.
    """
    tree, lines = cKDTree(target.vertices), []
    for name, through in stops.items():
        path = shortest_edge_path(source.vertices, source.triangles, through, False)
        along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(truth[path], axis=0), axis=1))])
        count = max(2, round(along[-1] / (_APART * height)) + 1)
        spread = np.unique(np.searchsorted(along, np.linspace(0, along[-1], count)).clip(0, len(path) - 1))
        near = tree.query(truth[path[spread]])[1]
        picked = near[np.append(True, near[1:] != near[:-1])].astype(np.int64)
        if len(picked) > 1:
            lines.append(FeatureLine(name, False, path, picked))
    return lines


def sample_stops(names: dict[str, int]) -> dict[str, list[int]]:
    """Source vertices of each guide on the samples, both sides."""
    stops: dict[str, list[int]] = {}
    for guide, words in GUIDES.items():
        for side in "lr":
            ids = [names[word] if word in names else names[f"{word}_{side}"] for word in words.split()]
            if ids not in stops.values():
                stops[f"{guide}_{side}"] = ids
    return stops


def ict_stops(marks: list[int], extra: list[int]) -> dict[str, list[int]]:
    """The same on the ICT performer, through its 68 landmarks and the points picked by place."""
    m, (temple_r, temple_l, bone_r, bone_l, cheek_r, cheek_l, top) = marks, extra
    return {
        "midline_upper": [top, *m[27:31], m[33], m[51]],
        "midline_lower": [m[57], m[8]],
        "brow_r": m[17:22],
        "brow_l": m[22:27],
        "nose_wing_r": [m[33], m[32], m[31]],
        "nose_wing_l": [m[33], m[34], m[35]],
        "nasolabial_fold_r": [m[31], m[48]],
        "nasolabial_fold_l": [m[35], m[54]],
        "corner_to_chin_r": [m[48], m[6]],
        "corner_to_chin_l": [m[54], m[10]],
        "jaw_r": m[8::-1],
        "jaw_l": m[8:17],
        "cheekbone_r": [m[0], bone_r, m[31]],
        "cheekbone_l": [m[16], bone_l, m[35]],
        "temporal_r": [m[17], temple_r, top],
        "temporal_l": [m[26], temple_l, top],
        "corner_to_ear_r": [m[48], cheek_r, m[1]],
        "corner_to_ear_l": [m[54], cheek_l, m[15]],
    }
