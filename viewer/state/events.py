"""What the user does, as plain values: recorded as JSON lines, and replayed from them.

A pointer event carries the ray and what it hit, in the displayed mesh's own unit and place, not the pixel: so a script
means the same at any size of the window.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from toolkit.errors import InputError

__all__ = ["Command", "Event", "Hit", "Key", "PanelInput", "Pointer", "TimelineInput", "event_from", "event_to"]

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Hit:
    """Where a ray meets the displayed mesh.

    ``triangle`` its id, ``barycentric`` of the point in it, ``vertex`` the nearest visible one on the screen,
    ``position`` in the mesh's unit.
    """

    triangle: int
    barycentric: Vector
    vertex: int
    position: Vector


@dataclass(frozen=True)
class Pointer:
    """The pointer over a pane (0 left, 1 right).

    ``kind`` is press, drag, release, hover or wheel; ``button`` left, middle, right or none; ``moved`` since the last
    event, in pane heights (x to the right, y up); ``travel`` the whole way since the press, in the same unit, so that a
    click can be told from a drag; ``wheel`` notches away from the user. ``origin`` and ``direction`` are the ray's.
    """

    kind: str
    pane: int
    button: str = "left"
    modifiers: tuple[str, ...] = ()
    origin: Vector = (0.0, 0.0, 0.0)
    direction: Vector = (0.0, 0.0, -1.0)
    hit: Hit | None = None
    moved: tuple[float, float] = (0.0, 0.0)
    travel: float = 0.0
    wheel: float = 0.0


@dataclass(frozen=True)
class Key:
    """A key pressed: ``name`` in lower case (``space``, ``left``, ``z``, ``1``, ``?``)."""

    name: str
    modifiers: tuple[str, ...] = ()


@dataclass(frozen=True)
class PanelInput:
    """A widget of the panel was used: ``name`` of its row, the new ``value``; ``final`` False while a slider moves."""

    name: str
    value: Any = None
    final: bool = True


@dataclass(frozen=True)
class TimelineInput:
    """The time line was used: ``what`` is scrub, first or last (ends of the window), or window (both, moved).

    ``grip`` is press, drag or release.
    """

    what: str
    frame: int
    grip: str = "release"


@dataclass(frozen=True)
class Command:
    """Something from a menu or a script: ``name`` and its ``argument``."""

    name: str
    argument: Any = None


Event = Pointer | Key | PanelInput | TimelineInput | Command

_KINDS: dict[str, type] = {
    "pointer": Pointer,
    "key": Key,
    "panel": PanelInput,
    "timeline": TimelineInput,
    "command": Command,
}
_NAMES = {kind: name for name, kind in _KINDS.items()}


def event_to(event: Event) -> dict[str, Any]:
    """The event as plain JSON values."""
    return {"event": _NAMES[type(event)], **asdict(event)}


def event_from(data: dict[str, Any]) -> Event:
    """The event of one line of a script."""
    values = dict(data)
    name = values.pop("event", None)
    if name not in _KINDS:
        raise InputError(f"there is no event {name!r}", remedy=f"events are {', '.join(_KINDS)}")
    hit = values.get("hit")
    try:
        if hit is not None:
            values["hit"] = Hit(
                int(hit["triangle"]), _vector(hit["barycentric"]), int(hit["vertex"]), _vector(hit["position"])
            )
        for key in ("origin", "direction", "modifiers", "moved"):
            if key in values:
                values[key] = tuple(values[key])
        event: Event = _KINDS[name](**values)
    except (TypeError, KeyError, ValueError) as error:
        raise InputError(f"the event {name!r} cannot be read ({error})") from error
    return event


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
