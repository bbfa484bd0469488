"""Edits, regions and curves as plain JSON values, for the journal and for files that users write by hand."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from toolkit.detail_edit.edits import DetailEdit, GainEdit, PasteEdit, ReshapeEdit, ScaleEdit
from toolkit.detail_edit.region import Region
from toolkit.detail_edit.surface import Curve, SurfacePoint
from toolkit.errors import InputError

__all__ = ["from_data", "plain", "read_field", "regions_from_data", "regions_to_data", "to_data"]

_KINDS: dict[str, type[Any]] = {"scale": ScaleEdit, "paste": PasteEdit, "reshape": ReshapeEdit, "gain": GainEdit}


def to_data(edit: DetailEdit) -> dict[str, Any]:
    """``{"kind": "scale", "region": {...}, ...}``, what is as by default left out."""
    kind = next(name for name, made in _KINDS.items() if type(edit) is made)
    data: dict[str, Any] = {"kind": kind}
    for one in fields(edit):
        value = getattr(edit, one.name)
        if one.default is MISSING or value != one.default:
            data[one.name] = plain(value)
    return data


def from_data(data: Mapping[str, Any], *, where: object = "") -> DetailEdit:
    """The reverse; ``where`` names the file in messages."""
    if not isinstance(data, Mapping) or data.get("kind") not in _KINDS:
        kind = data.get("kind") if isinstance(data, Mapping) else data
        raise InputError(f"{kind!r} is no detail edit", where=where, remedy=f'"kind" is one of {", ".join(_KINDS)}')
    made = _KINDS[data["kind"]]
    known = {one.name for one in fields(made)}
    values = {}
    for name, value in data.items():
        if name == "kind":
            continue
        if name not in known:
            raise InputError(f"{name!r} is unknown", where=where, remedy=f"known are {', '.join(sorted(known))}")
        values[name] = read_field(name, value, where=where)
    edit: DetailEdit = _read(lambda: made(**values), where=where)
    return edit


def regions_to_data(regions: Mapping[str, Region]) -> dict[str, Any]:
    """Named regions: ``{"regions": {name: {"vertices": [...], "weights": [...]}}}``."""
    return {"regions": {name: plain(region) for name, region in regions.items()}}


def regions_from_data(data: Mapping[str, Any], *, where: object = "") -> dict[str, Region]:
    """The reverse."""
    if not isinstance(data, Mapping) or not isinstance(data.get("regions"), Mapping):
        raise InputError('there is no table "regions"', where=where)
    return {str(name): _read(_region, value, where=where) for name, value in data["regions"].items()}


def plain(value: Any) -> Any:
    """A field's value as JSON values."""
    if isinstance(value, Region):
        data: dict[str, Any] = {"vertices": value.vertices.tolist()}
        return data if (value.weights == 1).all() else data | {"weights": value.weights.tolist()}
    if isinstance(value, Curve):
        return {"triangles": value.triangles.tolist(), "weights": value.weights.tolist()}
    if isinstance(value, SurfacePoint):
        return {"triangle": int(value.triangle), "weights": [float(weight) for weight in value.weights]}
    if isinstance(value, tuple):
        return [plain(one) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def read_field(name: str, value: Any, *, where: object = "") -> Any:
    """The reverse, of an edit's field ``name``; ``where`` names the file in messages."""
    return _read(_field, name, value, where=where)


def _field(name: str, value: Any) -> Any:
    if value is None or name not in _READERS:
        return value
    if name == "goal" and "triangles" in value:  # a curve where an edit reshapes, a point where it pastes
        return _curve(value)
    return _READERS[name](value)


def _region(value: Any) -> Region:
    vertices = np.array([_whole(vertex) for vertex in value["vertices"]], dtype=np.int64)
    return Region(vertices, np.asarray(value.get("weights", np.ones(len(vertices))), dtype=np.float64))


def _curve(value: Any) -> Curve:
    triangles = np.array([_whole(triangle) for triangle in value["triangles"]], dtype=np.int64)
    weights = np.asarray(value["weights"], dtype=np.float64)
    if weights.shape != (len(triangles), 3) or not np.isfinite(weights).all():
        raise ValueError(f"{len(triangles)} points need weights of shape ({len(triangles)}, 3), got {weights.shape}")
    return Curve(triangles, weights)


def _point(value: Any) -> SurfacePoint:
    a, b, c = (float(weight) for weight in value["weights"])
    return SurfacePoint(_whole(value["triangle"]), (a, b, c))


def _window(value: Any) -> tuple[int, int]:
    first, last = value
    return _whole(first), _whole(last)


def _gains(value: Any) -> tuple[tuple[int, float], ...]:
    return tuple((_whole(frame), float(gain)) for frame, gain in value)


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise ValueError(f"{value!r} is no whole number")
    return int(value)


_READERS: dict[str, Callable[[Any], Any]] = {
    "region": _region,
    "curve": _curve,
    "start": _point,
    "goal": _point,
    "window": _window,
    "gains": _gains,
    "frame": _whole,
    "source_frame": _whole,
}


def _read(make: Any, *values: Any, where: object) -> Any:
    try:
        return make(*values)
    except InputError as error:
        raise InputError(error.what, where=where, remedy=error.remedy) from error
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise InputError(f"the edit's values make no sense ({error})", where=where) from error
