"""The kinds of detail edit, as plain values (the paper's section 5.2)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from toolkit.detail_edit.region import Region
from toolkit.detail_edit.surface import Curve, SurfacePoint
from toolkit.errors import InputError

__all__ = ["DetailEdit", "GainEdit", "KeyedEdit", "PasteEdit", "ReshapeEdit", "ScaleEdit"]

_DETAILS = ("dynamic", "static")
_PROPAGATIONS = ("follow", "gradients")


@dataclass(frozen=True, eq=False, kw_only=True)
class KeyedEdit:
    """What all edits at a key frame have in common.

    ``region`` the wrinkle; ``frame`` the key frame; ``band`` the width of the smoothing band round the region, in edge
    lengths of the mesh there; ``window`` first and last frame, or None: found by ``threshold`` (`find_window`).
    ``details`` "dynamic", the motion details of the take, or "static", the face's own, which are there in all frames.
    ``propagation`` "follow" or the paper's "gradients" (`toolkit.detail_edit.propagation`).
    """

    region: Region
    frame: int
    band: float = 3.0
    window: tuple[int, int] | None = None
    threshold: float = 0.23
    propagation: str = "follow"
    details: str = "dynamic"

    def __post_init__(self) -> None:
        if len(self.region) == 0:
            raise InputError("the region is empty", remedy="paint it, or select it by a curve and a distance")
        _check_choice("details", self.details, _DETAILS)
        _check_choice("propagation", self.propagation, _PROPAGATIONS)
        _check_finite(band=self.band, threshold=self.threshold)
        if self.band < 0 or not 0 < self.threshold <= 1:
            raise InputError(
                f"a band of {self.band} edges with a threshold of {self.threshold} makes no sense",
                remedy="the band is 0 or more, the threshold between 0 and 1",
            )


@dataclass(frozen=True, eq=False, kw_only=True)
class ScaleEdit(KeyedEdit):
    """Enhance, diminish or remove: the details times ``factor``; 0 removes, below 0 turns valleys into ridges."""

    factor: float

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_finite(factor=self.factor)


@dataclass(frozen=True, eq=False, kw_only=True)
class PasteEdit(KeyedEdit):
    """Copy the region's details to another place, in place of what is there.

    ``start`` a point of the region that goes to ``goal``; without a goal it stays, or with ``mirror`` goes to the same
    place on the other side. Round there the wrinkle is turned by ``rotation`` degrees (counter-clockwise, seen from
    outside), ``scale`` times as large, its depth as well, which ``strength`` multiplies. Not turned means: as the skin
    at the start would lie if it were carried to the goal with the smallest turn. ``mirror`` exchanges left and right.

    ``source_frame`` is where the details come from, the key frame by default; ``source_shot`` names another shot of the
    same topology, which the caller opens. They go on as they do in the source, frame by frame, unless ``hold`` keeps
    those of the source frame. ``add`` lays them over what is there.
    """

    start: SurfacePoint
    goal: SurfacePoint | None = None
    rotation: float = 0.0
    scale: float = 1.0
    mirror: bool = False
    strength: float = 1.0
    source_frame: int | None = None
    source_shot: str | None = None
    hold: bool = False
    add: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_finite(rotation=self.rotation, scale=self.scale, strength=self.strength)
        if self.scale <= 0:
            raise InputError(f"a wrinkle cannot be {self.scale} times as large", remedy="give a scale above 0")


@dataclass(frozen=True, eq=False, kw_only=True)
class ReshapeEdit(KeyedEdit):
    """Bend the region so that its wrinkle, which runs along ``curve``, runs along ``goal`` (Eq. 17).

    Points correspond by arc length, in whichever direction takes the ends less far; the wrinkle is removed where it
    was. ``stiffness`` is the weight of the term that keeps the region in shape.
    """

    curve: Curve
    goal: Curve
    stiffness: float = 0.2

    def __post_init__(self) -> None:
        super().__post_init__()
        if min(len(self.curve), len(self.goal)) < 2:
            raise InputError("a curve needs at least two points", remedy="draw it through two points or more")
        if not (np.isfinite(self.stiffness) and self.stiffness > 0):
            raise InputError(f"a stiffness of {self.stiffness} makes no sense", remedy="give a number above 0")


@dataclass(frozen=True, eq=False, kw_only=True)
class GainEdit:
    """Details times a gain over time: ``gains`` are (frame, gain) in order, joined smoothly, constant before and after.

    One entry is a gain for the whole take (the paper's weaker details for a baby). ``region`` None is the whole face.
    "static" details take one gain only.
    """

    gains: tuple[tuple[int, float], ...]
    region: Region | None = None
    band: float = 3.0
    details: str = "dynamic"

    def __post_init__(self) -> None:
        _check_choice("details", self.details, _DETAILS)
        _check_finite(band=self.band)
        frames = [frame for frame, _ in self.gains]
        if not frames or any(b <= a for a, b in pairwise(frames)):
            raise InputError(
                f"the gain's frames {frames} must be one or more, each later than the one before",
                remedy="name each frame once, in order",
            )
        if not all(np.isfinite(gain) for _, gain in self.gains):
            raise InputError(
                f"the gains {[gain for _, gain in self.gains]} are not all numbers", remedy="give finite numbers"
            )
        if self.details == "static" and len(self.gains) > 1:
            raise InputError(
                "the face's own details are the same in all frames and take one gain", remedy="give one (frame, gain)"
            )
        if self.region is not None and len(self.region) == 0:
            raise InputError("the region is empty", remedy="leave it out for the whole face")


DetailEdit = ScaleEdit | PasteEdit | ReshapeEdit | GainEdit


def _check_choice(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise InputError(f"{name} = {value!r} is unknown", remedy=f"it is one of {', '.join(known)}")


def _check_finite(**values: float) -> None:
    for name, value in values.items():
        if not np.isfinite(value):
            raise InputError(f"{name} = {value} is no number", remedy="give a finite one")
