"""Making a shot folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from toolkit.errors import InputError
from toolkit.meshio.aside import written_aside
from toolkit.shot.config import ShotConfig, SourceInput, TargetInput, load_config, save_config

__all__ = ["create_shot"]


def create_shot(
    folder: Path,
    source_reference: Path,
    frames: Path,
    target: Path,
    *,
    landmarks: Path | None = None,
    feature_lines: Path | None = None,
    source_extras: Sequence[Path] = (),
    target_extras: Sequence[Path] = (),
    fps: float | None = None,
    force: bool = False,
) -> None:
    """Write ``shot.toml`` and copy the picks; everything else is referred to where it is.

    With ``force`` a ``shot.toml`` that is there is written anew. Raises InputError for files that are not there.
    """
    toml = folder / "shot.toml"
    if toml.exists() and not force:
        raise InputError("the shot exists already", where=toml, remedy="edit it, or give --force to write it anew")
    inputs = [("the source reference", source_reference), ("the frames", frames), ("the target", target)]
    inputs += [("the extras", path) for path in (*source_extras, *target_extras)]
    for what, path in inputs:
        if not path.exists():
            raise InputError(f"there is no such file for {what}", where=path, remedy="check the path")
    beside = [tuple(path.resolve() for path in extras) for extras in (source_extras, target_extras)]
    config = ShotConfig(
        SourceInput(source_reference.resolve(), frames.resolve(), fps, beside[0]),
        TargetInput(target.resolve(), beside[1]),
    )
    for name, picks in {"landmarks.json": landmarks, "feature_lines.json": feature_lines}.items():
        if picks is not None:
            _copy(picks, folder / name)
    folder.mkdir(parents=True, exist_ok=True)
    save_config(toml, config)
    load_config(toml)


def _copy(path: Path, to: Path) -> None:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", where=path, remedy="check the path") from error
    with written_aside(to) as temporary:
        temporary.write_bytes(content)
