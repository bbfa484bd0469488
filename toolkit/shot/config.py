"""``shot.toml``: inputs, frame rate, and one table of parameters a stage, the paper's values by default."""

from __future__ import annotations

import difflib
import math
import sys
from dataclasses import MISSING, asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

from toolkit.bases import BasisParameters
from toolkit.details import DetailParameters
from toolkit.errors import InputError
from toolkit.meshio.aside import written_aside
from toolkit.registration.parameters import RegistrationParameters
from toolkit.smoothing import SmoothingParameters
from toolkit.transfer import TransferParameters

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["ShotConfig", "SourceInput", "StabiliseParameters", "TargetInput", "load_config", "save_config"]

T = TypeVar("T")


@dataclass(frozen=True)
class SourceInput:
    """The performance: ``reference`` mesh, ``frames`` (folder or file), ``fps`` if the frames do not say it.

    ``extras`` are meshes for the pictures only, eyeballs for one: they ride stiffly with the head.
    """

    reference: Path
    frames: Path
    fps: float | None = None
    extras: tuple[Path, ...] = ()


@dataclass(frozen=True)
class TargetInput:
    """The face that it goes to: its ``reference`` mesh, of any topology, and ``extras`` for the pictures."""

    reference: Path
    extras: tuple[Path, ...] = ()


@dataclass(frozen=True)
class StabiliseParameters:
    """Whether the head's rigid motion is taken out before the work and put back on the result."""

    enabled: bool = True


@dataclass(frozen=True)
class ShotConfig:
    """Everything that ``shot.toml`` says; paths are absolute."""

    source: SourceInput
    target: TargetInput
    stabilise: StabiliseParameters = field(default_factory=StabiliseParameters)
    register: RegistrationParameters = field(default_factory=RegistrationParameters)
    smoothing: SmoothingParameters = field(default_factory=SmoothingParameters)
    bases: BasisParameters = field(default_factory=BasisParameters)
    transfer: TransferParameters = field(default_factory=TransferParameters)
    details: DetailParameters = field(default_factory=DetailParameters)


_STAGES: dict[str, Any] = {
    one.name: one.default_factory for one in fields(ShotConfig) if one.default_factory is not MISSING
}
_KINDS = {int: "a whole number", float: "a number", str: "a word in quotes", bool: "true or false"}


def load_config(path: Path) -> ShotConfig:
    """Read ``shot.toml``. Unknown or ill-typed keys are refused with the nearest known one."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise InputError(
            "there is no shot.toml", where=path.parent, remedy="make the shot with scripts/new_shot.py"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"this is not TOML ({error})", where=path, remedy="mend that line") from None
    _known(data, ["source", "target", *_STAGES], "table", path)
    kinds = {"reference": str, "frames": str, "fps": float, "extras": list}
    source = _inputs(data, "source", kinds, ["reference", "frames"], path)
    target = _inputs(data, "target", {"reference": str, "extras": list}, ["reference"], path)
    folder = path.parent
    stages: dict[str, Any] = {name: _table(kind, data.get(name, {}), name, path) for name, kind in _STAGES.items()}
    return ShotConfig(
        SourceInput(
            folder / source["reference"], folder / source["frames"], source.get("fps"), _extras(source, folder)
        ),
        TargetInput(folder / target["reference"], _extras(target, folder)),
        **stages,
    )


def save_config(path: Path, config: ShotConfig) -> None:
    """Write ``shot.toml`` with the parameters that differ from the defaults, and the defaults as comments."""
    lines = ["# Made by Mien. Lines that begin with # show the defaults.", "", "[source]"]
    lines += [f"reference = {_toml(str(config.source.reference))}", f"frames = {_toml(str(config.source.frames))}"]
    if config.source.fps is not None:
        lines.append(f"fps = {_toml(float(config.source.fps))}")
    lines.append(_extras_line(config.source.extras))
    lines += ["", "[target]", f"reference = {_toml(str(config.target.reference))}", _extras_line(config.target.extras)]
    for name, kind in _STAGES.items():
        lines += ["", f"[{name}]"]
        given, default = asdict(getattr(config, name)), asdict(kind())
        for key, value in given.items():
            comment = "" if value != default[key] else "# "
            shown = "" if value is None else f" {_toml(value)}"
            lines.append(f"{comment}{_spelled(key)} ={shown}")
    with written_aside(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _extras(table: dict[str, Any], folder: Path) -> tuple[Path, ...]:
    return tuple(folder / name for name in table.get("extras", []))


def _extras_line(paths: tuple[Path, ...]) -> str:
    if not paths:
        return '# extras = ["eyes.ply"]  # meshes for the pictures only, which ride with the head'
    return f"extras = [{', '.join(_toml(str(path)) for path in paths)}]"


def _inputs(data: dict[str, Any], name: str, kinds: dict[str, type], needed: list[str], path: Path) -> dict[str, Any]:
    table = data.get(name, {})
    if not isinstance(table, dict):
        raise InputError(f"{name} should be a table", where=path, remedy=f"write [{name}]")
    _known(table, list(kinds), f"key of [{name}]", path)
    for key in needed:
        if key not in table:
            raise InputError(f"[{name}] has no {key}", where=path, remedy=f'add {key} = "file"')
    return {key: _typed(value, kinds[key], f"[{name}] {key}", path) for key, value in table.items()}


def _table(kind: type[T], table: Any, name: str, path: Path) -> T:
    if not isinstance(table, dict):
        raise InputError(f"{name} should be a table", where=path, remedy=f"write [{name}]")
    allowed = {_spelled(f.name): f for f in fields(kind)}  # type: ignore[arg-type]
    _known(table, list(allowed), f"key of [{name}]", path)
    default = kind()
    values = {}
    for key, value in table.items():
        example = getattr(default, allowed[key].name)
        annotation = str(allowed[key].type)
        wanted = type(example) if example is not None else (int if annotation.startswith("int") else float)
        values[allowed[key].name] = _typed(value, wanted, f"[{name}] {key}", path)
    try:
        return kind(**values)
    except InputError as error:
        raise InputError(f"[{name}] {error.what}", where=path, remedy=error.remedy) from None


def _typed(value: Any, kind: type, what: str, path: Path) -> Any:
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if kind is list and not (isinstance(value, list) and all(isinstance(item, str) for item in value)):
        raise InputError(f"{what} = {value!r} should be a list of files", where=path, remedy='write ["eyes.ply"]')
    if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
        raise InputError(f"{what} = {value!r} should be {_KINDS[kind]}", where=path, remedy="mend the value")
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(f"{what} = {value} should be finite", where=path, remedy="mend the value")
    return value


def _known(table: dict[str, Any], allowed: list[str], what: str, path: Path) -> None:
    for key in table:
        if key not in allowed:
            near = difflib.get_close_matches(key, allowed, n=1)
            remedy = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(allowed)}"
            raise InputError(f"there is no {what} called {key!r}", where=path, remedy=remedy)


def _spelled(name: str) -> str:
    """A field's name as users write it: ``lambda`` is a word of Python."""
    return name.rstrip("_")


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return repr(value)
