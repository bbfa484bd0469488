"""Edits in a few words, for lists and buttons."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from toolkit.shot.journal import Edit, Step

__all__ = ["describe", "step_in_words"]


def describe(edit: Edit) -> str:
    """Such as ``2 points and 1 distance at frame 120, bases and weights, frames 90 to 150``."""
    say = {"pose": _pose, "detail": _detail}.get(edit.kind)
    try:
        words = say(edit.data) if say is not None else f"{edit.kind} edit"
    except (KeyError, TypeError, ValueError, AttributeError):  # a line that someone wrote by hand
        words = f"{edit.kind} edit that cannot be read"
    note = edit.data.get("note")
    return f"{words} ({note})" if note else words


def step_in_words(step: Step | None, kinds: Mapping[int, str]) -> str | None:
    """Such as ``switch off pose edit 2``; ``kinds`` are those of the edits by number."""
    if step is None:
        return None
    what = f"{step.kind or kinds.get(step.edit, '')} edit {step.edit}".strip()
    if step.name == "switch":
        return f"switch {'on' if step.on else 'off'} {what}"
    return f"{step.name} {what}"


def _pose(data: Mapping[str, Any]) -> str:
    constraints = data["constraints"]
    kinds = Counter(one["kind"] for one in constraints)
    parts = [_count(kinds[kind], kind) for kind in ("point", "distance") if kinds[kind]]
    parts += ["parts held"] if kinds["fixed"] or kinds["beyond"] else []
    parameters = data.get("parameters") or {}
    where = {"bases": "bases only", "weights": "weights only"}.get(str(parameters.get("mode")), "bases and weights")
    return f"{' and '.join(parts)}{_at(sorted(_frames(constraints)))}, {where}{_window(parameters.get('window'))}"


def _frames(constraints: list[Mapping[str, Any]]) -> set[int]:
    found: set[int] = set()
    for one in constraints:
        found |= {one["frame"]} if "frame" in one else set(one.get("frames") or ())
    return found


def _detail(data: Mapping[str, Any]) -> str:
    kind = data["kind"]
    what = "the face's own details" if data.get("details") == "static" else "wrinkles"
    if kind == "gain":
        gains = data["gains"]
        much = f"{what} times {gains[0][1]:g}" if len(gains) == 1 else f"{what} by a curve of {len(gains)} keys"
        return much if data.get("region") is None else f"{much} at {_count(len(data['region']['vertices']), 'vertex')}"
    words = {"scale": f"{what} times {data.get('factor', 0):g}", "paste": "wrinkle copied", "reshape": "wrinkle bent"}
    if kind == "scale" and data.get("factor") == 0:
        words["scale"] = f"{what} removed"
    size = _count(len(data["region"]["vertices"]), "vertex")
    return f"{words[kind]} at {size}{_at([data['frame']])}{_window(data.get('window'))}"


def _at(frames: list[int]) -> str:
    if not frames:
        return ""
    shown = ", ".join(map(str, frames[:3])) + (", …" if len(frames) > 3 else "")
    return f" at frame{'s' if len(frames) > 1 else ''} {shown}"


def _window(window: list[int] | None) -> str:
    return "" if window is None else f", frames {window[0]} to {window[1]}"


def _count(n: int, word: str) -> str:
    many = {"vertex": "vertices"}.get(word, f"{word}s")
    return f"{n:,} {word if n == 1 else many}"
