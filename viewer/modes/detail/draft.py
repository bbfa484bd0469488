"""A detail edit while it is made: plain values that never change, so that undo is a list of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from toolkit.detail_edit import (
    Curve,
    DetailEdit,
    GainEdit,
    PasteEdit,
    Region,
    ReshapeEdit,
    ScaleEdit,
    SurfacePoint,
)
from toolkit.detail_edit.data import from_data, plain, read_field, to_data
from toolkit.errors import InputError

__all__ = ["ACTIONS", "DetailDraft"]

ACTIONS = (
    ("scale", "enhance, diminish, remove"),
    ("paste", "copy to another place"),
    ("reshape", "bend along a new line"),
    ("gain", "gain over the take"),
)
_KINDS: dict[type, str] = {ScaleEdit: "scale", PasteEdit: "paste", ReshapeEdit: "reshape", GainEdit: "gain"}


@dataclass(frozen=True)
class DetailDraft:
    """What the user has asked for so far; `toolkit.detail_edit` says what the edits' own fields mean.

    ``line`` and ``goal_line`` are the points that the user gave, ``curve`` and ``goal_curve`` what was drawn tight
    through them; ``width`` and ``soft`` how far from the line the region reaches and fades, in face heights.
    ``everywhere`` lets a gain act on the whole face. ``instead_of`` is the number of the committed edit that is
    changed.
    """

    frame: int = 0
    action: str = "scale"
    region: Region | None = None
    line: tuple[SurfacePoint, ...] = ()
    curve: Curve | None = None
    width: float = 0.02
    soft: float = 0.012
    factor: float = 1.0
    start: SurfacePoint | None = None
    goal: SurfacePoint | None = None
    rotation: float = 0.0
    scale: float = 1.0
    strength: float = 1.0
    mirror: bool = False
    hold: bool = False
    add: bool = False
    source_frame: int | None = None
    source_shot: str | None = None
    goal_line: tuple[SurfacePoint, ...] = ()
    goal_curve: Curve | None = None
    stiffness: float = 0.2
    gains: tuple[tuple[int, float], ...] = ()
    everywhere: bool = False
    details: str = "dynamic"
    band: float = 3.0
    window: tuple[int, int] | None = None
    threshold: float = 0.23
    propagation: str = "follow"
    note: str = ""
    instead_of: int | None = None

    @property
    def missing(self) -> str:
        """What is still to be done before there is an edit; nothing if there is."""
        if self.action == "gain":
            steps = [
                (bool(self.gains), "set a gain"),
                (self.everywhere or self._painted, "paint a region, or take the whole face"),
            ]
        else:
            here = self.goal is not None or self.mirror or self._elsewhere
            steps = [
                (self._painted, "paint the wrinkle, or draw a line along it"),
                (self.action != "paste" or (self.start is not None and here), "point to where the copy goes"),
                (self.action != "reshape" or self.curve is not None, "draw a line along the wrinkle"),
                (self.action != "reshape" or self.goal_curve is not None, "draw the line that it is to follow"),
            ]
        return next((words for done, words in steps if not done), "")

    @property
    def empty(self) -> bool:
        """Whether there is nothing to solve yet."""
        return bool(self.missing)

    @property
    def frames(self) -> list[int]:
        """The key frame; the keys of a gain."""
        return [frame for frame, _ in self.gains] if self.action == "gain" else [self.frame]

    @property
    def highest(self) -> tuple[int, int, int]:
        """The highest frame, vertex and triangle that it names."""
        frames = [self.frame, *self.frames, *(self.window or ())]
        vertex = int(self.region.vertices[-1]) if self._painted and self.region is not None else -1
        points = [point for point in (self.start, self.goal) if point is not None]
        triangles = [point.triangle for point in (*points, *self.line, *self.goal_line)]
        triangles += [int(curve.triangles.max()) for curve in (self.curve, self.goal_curve) if curve is not None]
        return max(frames), vertex, max(triangles, default=-1)

    def edit(self) -> DetailEdit:
        """For the solver; only where nothing is `missing`."""
        if self.action == "gain":
            region = None if self.everywhere else self.region
            gains = self.gains[:1] if self.details == "static" else self.gains
            return GainEdit(gains=gains, region=region, band=self.band, details=self.details)
        assert self.region is not None
        common: dict[str, Any] = {
            "region": self.region,
            "frame": self.frame,
            "band": self.band,
            "window": self.window,
            "threshold": self.threshold,
            "propagation": self.propagation,
            "details": self.details,
        }
        if self.action == "scale":
            return ScaleEdit(**common, factor=self.factor)
        if self.action == "reshape":
            assert self.curve is not None
            assert self.goal_curve is not None
            return ReshapeEdit(**common, curve=self.curve, goal=self.goal_curve, stiffness=self.stiffness)
        assert self.start is not None
        pasting = ("start", "goal", "rotation", "scale", "mirror", "strength", "source_frame", "source_shot")
        return PasteEdit(**common, **{name: getattr(self, name) for name in (*pasting, "hold", "add")})

    def data(self) -> dict[str, Any]:
        """As the journal holds it."""
        return to_data(self.edit()) | ({"note": self.note} if self.note else {})

    def to_data(self) -> dict[str, Any]:
        """Everything of it that is not as at the start."""
        data: dict[str, Any] = {"frame": self.frame}
        for one in fields(self):
            value = getattr(self, one.name)
            if value != one.default:
                data[one.name] = plain(value)
        return data

    @classmethod
    def from_data(cls, data: Mapping[str, Any], number: int | None = None) -> DetailDraft:
        """The reverse of `data` and of `to_data`; InputError for what is no edit."""
        if "kind" in data:
            return cls._from_edit(data, number)
        known = {one.name for one in fields(cls)}
        unknown = [name for name in data if name not in known]
        if unknown:
            raise InputError(f"{unknown[0]!r} is unknown in an open edit")
        return cls(**{name: _read(name, value) for name, value in data.items()})

    @classmethod
    def _from_edit(cls, data: Mapping[str, Any], number: int | None) -> DetailDraft:
        edit = from_data({name: value for name, value in data.items() if name != "note"})
        values = {one.name: getattr(edit, one.name) for one in fields(edit)}
        if isinstance(edit, ReshapeEdit):
            values["goal_curve"] = values.pop("goal")
        if isinstance(edit, GainEdit):
            values["everywhere"] = edit.region is None
        note = str(data.get("note", ""))
        return cls(action=_KINDS[type(edit)], note=note, instead_of=number, **values)

    def with_gain(self, frame: int, gain: float) -> DetailDraft:
        """With a key of the gain set or added."""
        gains = {**dict(self.gains), frame: gain}
        return replace(self, gains=tuple(sorted(gains.items())))

    @property
    def _painted(self) -> bool:
        return self.region is not None and len(self.region) > 0

    @property
    def _elsewhere(self) -> bool:
        """Whether a copy on to its own place changes anything."""
        other = self.source_frame is not None and self.source_frame != self.frame
        return other or self.source_shot is not None or self.rotation != 0 or self.scale != 1 or self.strength != 1


# What an edit does not have, or calls by another name.
_FIELDS = {"line": "start", "goal_line": "start", "goal_curve": "curve"}


def _read(name: str, value: Any) -> Any:
    field = _FIELDS.get(name, name)
    return tuple(read_field(field, one) for one in value) if name in ("line", "goal_line") else read_field(field, value)
