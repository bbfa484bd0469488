"""The six sample heads: sums of the package's morphs, and each head's expression offsets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data.eyelids import closed_lids
from data.layout import hand_made, load_layout
from data.package import Package
from data.rims import closed_lips

__all__ = ["HEADS", "SHAPES", "Head", "build_head", "face_units"]

Array = NDArray[np.float64]

HEADS = ("male_young", "african_old", "asian_female", "child", "orc", "hound")
_SIDED = "browDown browOuterUp cheekSquint eyeBlink eyeLookDown eyeLookIn eyeLookOut eyeLookUp eyeSquint eyeWide "
_SIDED += "mouthDimple mouthFrown mouthLowerDown mouthPress mouthSmile mouthStretch mouthUpperUp noseSneer"
_SINGLE = "browInnerUp cheekPuff jawForward jawLeft jawOpen jawRight mouthClose mouthFunnel mouthLeft mouthPucker "
_SINGLE += "mouthRight mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper tongueOut"
SHAPES: tuple[str, ...] = tuple(
    sorted([name + side for name in _SIDED.split() for side in ("Left", "Right")] + _SINGLE.split())
)
"""The 52 ARKit names, in alphabetical order: the order of every weight array ``(T, 52)`` of the samples."""

_CLOSURE_RACE = {"african_old": "african", "asian_female": "asian"}
_EYE_CENTRE_IDS = slice(13606, 13622)


@dataclass(frozen=True)
class Head:
    """One head at base resolution: ``neutral`` (4326, 3) and ``offsets`` (52, 4326, 3) of ``SHAPES``, in cm."""

    name: str
    neutral: Array
    offsets: Array

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
    head = Head(name, neutral, offsets)
    return _with_blinks(package, head, gain[layout.base_ids])


def face_units(package: Package) -> Array:
    """Return the 52 offsets ``(52, 4326, 3)``, cm, scaled and with a little jaw where lips would cross alone."""
    ids, cures = load_layout(package).base_ids, hand_made("cures")
    raw = {name: package.target(f"faceunits/{name}")[ids] for name in SHAPES}
    cured = []
    for name in SHAPES:
        cure = cures.get(name, {})
        added = sum(weight * raw[other] for other, weight in cure.get("add", {}).items())
        cured.append(cure.get("scale", 1.0) * raw[name] + added)
    return np.stack(cured)


def _with_blinks(package: Package, head: Head, gain: Array) -> Head:
    """Replace eyeBlink, which over-closes by 5-9 mm, by MakeHuman's eye closure, weighted so that the rims meet."""
    layout = load_layout(package)
    race = _CLOSURE_RACE.get(head.name, "caucasian")
    offsets = head.offsets.copy()
    for side, arkit in (("left", "eyeBlinkLeft"), ("right", "eyeBlinkRight")):
        closure = package.target(f"expression/units/{race}/eye-{side}-closure")[layout.base_ids] * gain[:, None]
        offsets[SHAPES.index(arkit)] = closed_lids(layout, head.neutral, closure, side)
    return Head(head.name, head.neutral, offsets)


def _muzzle(from_eyes: Array) -> Array:
    """Return how much of the hound's muzzle each vertex takes, 0..1; ``from_eyes`` (V, 3) in cm from the eyes."""
    x, y, z = (0.1 * from_eyes).T
    dy = y + 0.64
    eyes_kept = 1 - np.exp(-((((np.abs(x) - 0.31) / 0.24) ** 2 + (y / 0.22) ** 2) ** 2))
    height = np.exp(-((dy / np.where(dy > 0, 0.40, 0.42)) ** 2))
    depth = np.clip((z + 0.55) / 1.05, 0, 1)
    return eyes_kept * height * np.exp(-((x / 0.48) ** 2)) * depth**2 * (3 - 2 * depth)
