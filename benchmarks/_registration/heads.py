"""Pairs of faces with known answers: the sample heads, and where on them errors are judged."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from toolkit.feature_lines import FeatureLine, load_feature_lines
from toolkit.mesh import TriangleMesh
from toolkit.meshio import read_mesh
from toolkit.registration import Landmarks, load_landmarks
from toolkit.registration.curves import loops_of, source_rims
from toolkit.registration.interior import behind_loops

__all__ = ["Head", "regions", "sample_heads"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Head:
    """One pair of faces with its known answer; ``region`` masks (V,) by name, ``marks`` the landmarks by their number.

    ``lines`` round lids and lips and the guides, all on both faces.
    """

    name: str
    source: TriangleMesh
    target: TriangleMesh
    truth: Array
    lines: list[FeatureLine]
    marks: dict[int, Landmarks]
    height: float
    region: dict[str, Mask]


def sample_heads(names: Sequence[str], level: int, cache: Path | None) -> Iterator[Head]:
    """The samples of these names, one after the other."""
    from data.samples import ensure_samples

    if not names:
        return
    samples = ensure_samples(cache, targets=names, level=level)
    source = read_mesh(samples.performer.reference)
    places = json.loads(samples.performer.landmarks.read_text(encoding="utf-8"))
    for name in names:
        paths = samples.targets[name]
        truth = samples.truth(name).shape(np.zeros(52))
        lines = load_feature_lines(paths.feature_lines)
        marks = {30: load_landmarks(paths.landmarks_30), 45: load_landmarks(paths.landmarks)}
        yield _head(name, source, read_mesh(paths.reference), truth, lines, marks, places)


def _head(
    name: str,
    source: TriangleMesh,
    target: TriangleMesh,
    truth: Array,
    lines: list[FeatureLine],
    marks: dict[int, Landmarks],
    names: dict[str, int],
) -> Head:
    at = {key: source.vertices[vertex] for key, vertex in names.items()}
    left, right, tip = at["tragus_l"], at["tragus_r"], at["nose_tip"]
    jaw = (at["jaw_gonion_l"], at["jaw_gonion_r"])
    face = np.ones(source.n_vertices, dtype=bool)
    for a, b, c in ((left, right, at["forehead_high"]), (left, right, jaw[0]), (*jaw, at["menton"])):
        normal = np.cross(b - a, c - a)
        face &= (source.vertices - a) @ (normal * np.sign(normal @ (tip - a))) > 0
    height = float(np.linalg.norm(truth[names["menton"]] - truth[names["forehead_high"]]))
    return Head(name, source, target, truth, lines, marks, height, regions(source, truth, lines, face, height / 18))


def regions(source: TriangleMesh, truth: Array, lines: list[FeatureLine], face: Mask, cm: float) -> dict[str, Mask]:
    """Masks ``(V,)`` of the face but for what is behind its openings, and of all within ``cm`` of lips and lids."""
    face = face & ~behind_loops(source, loops_of(source_rims(lines, source)))
    found = {"face": face}
    for key, words in (("lips", ("lip_inner", "inner_lip")), ("lids", ("lid",))):
        rims = [line.vertices for line in lines if not line.guide and any(word in line.name for word in words)]
        rim = np.concatenate(rims)
        found[key] = face & (cKDTree(truth[rim]).query(truth)[0] < cm)
    return found
