"""Edits as plain JSON values, for the journal and for constraint files that users write by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from typing import Any

from toolkit.errors import InputError
from toolkit.pose_edit.constraints import (
    BeyondConstraint,
    Constraint,
    DistanceConstraint,
    FixedConstraint,
    PointConstraint,
)
from toolkit.pose_edit.parameters import EditParameters

__all__ = ["from_data", "to_data"]

_KINDS: dict[str, type[Constraint]] = {
    "point": PointConstraint,
    "distance": DistanceConstraint,
    "fixed": FixedConstraint,
    "beyond": BeyondConstraint,
}


def to_data(constraints: Sequence[Constraint], parameters: EditParameters) -> dict[str, Any]:
    """``{"constraints": [{"kind": "point", ...}, ...], "parameters": {...}}``, what is None left out."""
    names = {kind: name for name, kind in _KINDS.items()}
    listed = [{"kind": names[type(one)], **_given(asdict(one))} for one in constraints]
    return {"constraints": listed, "parameters": _given(asdict(parameters))}


def from_data(data: Mapping[str, Any], *, where: object = "") -> tuple[list[Constraint], EditParameters]:
    """The reverse; ``where`` names the file in messages."""
    if not isinstance(data, Mapping) or not isinstance(data.get("constraints"), list):
        raise InputError('an edit has no list "constraints"', where=where)
    constraints: list[Constraint] = []
    for index, one in enumerate(data["constraints"]):
        place = f"{where}, constraint {index}" if where else f"constraint {index}"
        if not isinstance(one, Mapping) or one.get("kind") not in _KINDS:
            raise InputError(f"{one!r} is no constraint", where=place, remedy=f'"kind" is one of {", ".join(_KINDS)}')
        rest = {name: value for name, value in one.items() if name != "kind"}
        constraints.append(_made(_KINDS[one["kind"]], rest, place))
    return constraints, _made(EditParameters, data.get("parameters") or {}, where or "parameters")


def _made(kind: type[Any], values: Mapping[str, Any], where: object) -> Any:
    known = [field.name for field in fields(kind)]
    unknown = [name for name in values if name not in known]
    if unknown:
        raise InputError(f"{unknown[0]!r} is unknown", where=where, remedy=f"known are {', '.join(known)}")
    try:
        return kind(**{name: tuple(value) if isinstance(value, list) else value for name, value in values.items()})
    except (TypeError, ValueError) as error:
        what = error.what if isinstance(error, InputError) else f"the values make no sense ({error})"
        raise InputError(what, where=where, remedy=getattr(error, "remedy", "")) from error


def _given(values: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: list(value) if isinstance(value, tuple) else value for name, value in values.items() if value is not None
    }
