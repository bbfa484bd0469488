"""One entry for all formats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from toolkit.errors import InputError
from toolkit.export.performance import Performance
from toolkit.meshio.leftovers import remove_leftovers
from toolkit.progress import Progress, silent

__all__ = ["FORMATS", "ExportReport", "Format", "export", "file_name"]


@dataclass(frozen=True)
class Format:
    """A format in ``words``, and the ``suffixes`` of its files, the first by default; none for a folder of frames."""

    words: str
    suffixes: tuple[str, ...]
    writer: str  # module:function, imported when the format is asked for


FORMATS = {
    "gltf": Format("glTF (.glb): bases as morph targets", (".glb",), "gltf:write_glb"),
    "usd": Format("USD (.usdc)", (".usdc", ".usd", ".usda"), "usd:write_usd"),
    "abc": Format("Alembic (.abc)", (".abc",), "alembic:write_alembic"),
    "pc2": Format("PC2 point cache", (".pc2",), "point_caches:write_pc2"),
    "mdd": Format("MDD point cache", (".mdd",), "point_caches:write_mdd"),
    "npy": Format("NumPy frames (.npy)", (".npy",), "point_caches:write_npy"),
    "obj": Format("OBJ, a file a frame", (), "folders:write_obj_frames"),
    "ply": Format("PLY, a file a frame", (), "folders:write_ply_frames"),
}


@dataclass(frozen=True)
class ExportReport:
    """What was written: ``path`` (a folder for ``obj`` and ``ply``), ``n_frames`` and its size ``n_bytes``.

    ``rms_deviation`` and ``max_deviation`` say how far, in the target's unit, the file's frames lie from the exact
    ones (distances of vertices): zero for the formats that hold exact float32 frames, and for glTF, which holds bases
    and weights, what the bases leave out.
    """

    path: Path
    format: str
    n_frames: int
    n_bytes: int
    rms_deviation: float = 0.0
    max_deviation: float = 0.0


def file_name(performance: Performance, format: str) -> str:
    """What a performance is called in a format, where nobody gives a path."""
    suffixes = FORMATS[format].suffixes
    return performance.name + suffixes[0] if suffixes else f"{performance.name}_{format}"


def export(performance: Performance, path: str | Path, format: str, progress: Progress = silent) -> ExportReport:
    """Write a performance to ``path`` in one of `FORMATS`; it appears there only when it is complete.

    What killed exports left half written beside it is removed.

    Raises
    ------
    InputError : an unknown format, a path that does not suit it, a folder that holds other files
    MissingDependencyError : a package that only this format needs is not installed
    """
    path = Path(path)
    chosen = FORMATS.get(format)
    if chosen is None:
        raise InputError(f"{format!r} is not known as an export format", remedy=f"use one of {' '.join(FORMATS)}")
    if chosen.suffixes and path.suffix.lower() not in chosen.suffixes:
        remedy = f"give a name that ends in {' or '.join(chosen.suffixes)}"
        raise InputError(f"the name does not suit the format {format}", where=path, remedy=remedy)
    if bool(chosen.suffixes) == path.is_dir() and path.exists():
        what = "is a folder, but the format is one file" if chosen.suffixes else "is a file, but the format is a folder"
        raise InputError(what, where=path, remedy="give another path")
    remove_leftovers(path.parent)
    module, function = chosen.writer.split(":")
    write: Callable = getattr(import_module(f"toolkit.export.{module}"), function)
    deviation = write(performance, path, progress) or (0.0, 0.0)
    return ExportReport(path, format, performance.n_frames, _size(path), *deviation)


def _size(path: Path) -> int:
    files = path.iterdir() if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files)
