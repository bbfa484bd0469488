"""The six sample heads: sums of the package's morphs, and each head's expression offsets."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from data.eyelids import closed_lids
from data.layout import hand_made, load_layout
from data.package import Package
from data.remeshing import split_quads
from data.rims import closed_lips
from data.subdivision import catmull_clark
from toolkit.mesh import vertex_adjacency

__all__ = ["EYES", "HEADS", "PERFORMER", "SHAPES", "Head", "build_head", "eyeballs", "face_units"]

Array = NDArray[np.float64]

PERFORMER = "male_young"
HEADS = (PERFORMER, "african_old", "asian_female", "child", "orc", "hound")
_SIDED = "browDown browOuterUp cheekSquint eyeBlink eyeLookDown eyeLookIn eyeLookOut eyeLookUp eyeSquint eyeWide "
_SIDED += "mouthDimple mouthFrown mouthLowerDown mouthPress mouthSmile mouthStretch mouthUpperUp noseSneer"
_SINGLE = "browInnerUp cheekPuff jawForward jawLeft jawOpen jawRight mouthClose mouthFunnel mouthLeft mouthPucker "
_SINGLE += "mouthRight mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper tongueOut"
SHAPES: tuple[str, ...] = tuple(
    sorted([name + side for name in _SIDED.split() for side in ("Left", "Right")] + _SINGLE.split())
)
"""The 52 ARKit names, in alphabetical order: the order of every weight array ``(T, 52)`` of the samples."""

_CLOSURE_RACE = {"african_old": "african", "asian_female": "asian"}
EYES = slice(14598, 14742)
"""Ids of the eyeballs in the package's mesh."""
_EYE_CENTRE_IDS = slice(13606, 13622)
_FOREHEAD = (2.0, 7.6, 6.5, -4.0)
"""Lower and upper end, half width and rear end of the forehead, cm from the base mesh's eyes."""


@dataclass(frozen=True)
class Head:
    """One head at base resolution, in cm, the eyes' centre at the origin.

    ``neutral`` (4326, 3), ``offsets`` (52, 4326, 3) of ``SHAPES``, and ``eyes`` (144, 3), the control points of the
    two eyeballs, for pictures: no shape moves them.
    """

    name: str
    neutral: Array
    offsets: Array
    eyes: Array

    def shape(self, weights: Array) -> Array:
        """Control points ``(4326, 3)`` of the expression ``weights`` (52,): shapes add."""
        return self.neutral + np.tensordot(weights, self.offsets, 1)


def build_head(package: Package, name: str) -> Head:
    """Build a head of ``HEADS`` with its 52 cured shapes."""
    layout = load_layout(package)
    whole = package.vertices + sum(weight * package.target(target) for target, weight in hand_made("recipes")[name])
    eye_centre = whole[_EYE_CENTRE_IDS].mean(0)
    gain = np.ones(len(whole))
    if name == "hound":
        bulge = _muzzle(whole - eye_centre)
        whole = whole + np.stack([-0.22 * bulge * whole[:, 0], -2.2 * bulge, 9.5 * bulge], axis=1)
        gain = 1 + 0.5 * bulge
    if name == "child":
        gain = np.full(len(whole), 0.8)
    centre = whole[_EYE_CENTRE_IDS].mean(0) if name != "hound" else eye_centre
    neutral = (whole - centre)[layout.base_ids]
    neutral = neutral + closed_lips(layout, neutral)
    offsets = face_units(package) * gain[layout.base_ids, None]
    head = Head(name, neutral, offsets, (whole - centre)[EYES])
    return _with_blinks(package, head, gain[layout.base_ids])


def eyeballs(package: Package, control: Array) -> tuple[Array, NDArray[np.int32]]:
    """Smooth eyeballs: vertices (E, 3) and triangles of the control points ``(144, 3)`` after two rounds."""
    inside = (package.quads >= EYES.start) & (package.quads < EYES.stop)
    eyes = catmull_clark(package.quads[inside.all(axis=1)] - EYES.start, EYES.stop - EYES.start, 2)
    return eyes.matrix @ control, split_quads(eyes.quads[-1])


def face_units(package: Package) -> Array:
    """Return the 52 offsets ``(52, 4326, 3)``, cm, scaled and with a little jaw where lips would cross alone."""
    ids, cures = load_layout(package).base_ids, hand_made("cures")
    raw = {name: package.target(f"faceunits/{name}")[ids] for name in SHAPES}
    cured = []
    for name in SHAPES:
        cure = cures.get(name, {})
        added = sum(weight * raw[other] for other, weight in cure.get("add", {}).items())
        cured.append(cure.get("scale", 1.0) * raw[name] + added)
    brows = [k for k, name in enumerate(SHAPES) if name.startswith("brow")]
    for k, spread in zip(brows, _over_forehead(package, [cured[k] for k in brows]), strict=True):
        cured[k] = spread
    return np.stack(cured)


def _over_forehead(package: Package, offsets: list[Array]) -> list[Array]:
    """Spread offsets ``(4326, 3)`` of the brows over the forehead, up to the hairline.

    The package's brows crowd all their motion into the 2 cm above them; a real forehead slides as a whole (its muscle
    starts at the hairline). The forehead's offsets become harmonic between the brows and what does not move.
    """
    layout = load_layout(package)
    points = package.vertices[layout.base_ids]
    x, y, z = (points - package.vertices[_EYE_CENTRE_IDS].mean(0)).T
    low, high, wide, back = _FOREHEAD
    free = (y > low) & (y < high) & (np.abs(x) < wide) & (z > back)
    neighbours = vertex_adjacency(split_quads(layout.quads(0)), len(points))
    laplacian = sp.csr_matrix(sp.diags(np.asarray(neighbours.sum(1)).ravel()) - neighbours)[free]
    solver = splu(laplacian[:, free].tocsc())
    spread = []
    for offset in offsets:
        moved = offset.copy()
        moved[free] = solver.solve(-(laplacian[:, ~free] @ offset[~free]))
        spread.append(moved)
    return spread


def _with_blinks(package: Package, head: Head, gain: Array) -> Head:
    """Replace eyeBlink, which over-closes by 5-9 mm, by MakeHuman's eye closure, weighted so that the rims meet."""
    layout = load_layout(package)
    race = _CLOSURE_RACE.get(head.name, "caucasian")
    offsets = head.offsets.copy()
    for side, arkit in (("left", "eyeBlinkLeft"), ("right", "eyeBlinkRight")):
        closure = package.target(f"expression/units/{race}/eye-{side}-closure")[layout.base_ids] * gain[:, None]
        offsets[SHAPES.index(arkit)] = closed_lids(layout, head.neutral, closure, side)
    return replace(head, offsets=offsets)


def _muzzle(from_eyes: Array) -> Array:
    """Return how much of the hound's muzzle each vertex takes, 0..1; ``from_eyes`` (V, 3) in cm from the eyes."""
    x, y, z = (0.1 * from_eyes).T
    dy = y + 0.64
    eyes_kept = 1 - np.exp(-((((np.abs(x) - 0.31) / 0.24) ** 2 + (y / 0.22) ** 2) ** 2))
    height = np.exp(-((dy / np.where(dy > 0, 0.40, 0.42)) ** 2))
    depth = np.clip((z + 0.55) / 1.05, 0, 1)
    return eyes_kept * height * np.exp(-((x / 0.48) ** 2)) * depth**2 * (3 - 2 * depth)
