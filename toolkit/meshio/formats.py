"""Which reader and writer a file name asks for, and what is said when there is none."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio.sequence import FrameSequence, checked_fps

__all__ = ["MESH_SUFFIXES", "SEQUENCE_SUFFIXES", "open_sequence", "read_mesh", "write_mesh"]

# suffix -> module and function: imported when the format is asked for.
_MESH_READERS = {
    ".obj": "obj:read_obj",
    ".ply": "ply:read_ply",
    ".stl": "stl:read_stl",
    ".gltf": "gltf:read_gltf",
    ".glb": "gltf:read_gltf",
    ".usd": "usd:read_usd",
    ".usda": "usd:read_usd",
    ".usdc": "usd:read_usd",
    ".usdz": "usd:read_usd",
    ".abc": "alembic:read_alembic",
}
_SEQUENCE_READERS = {
    ".npy": "point_caches:open_npy",
    ".npz": "point_caches:open_npz",
    ".pc2": "point_caches:open_pc2",
    ".mdd": "point_caches:open_mdd",
    ".gltf": "gltf:open_gltf",
    ".glb": "gltf:open_gltf",
    ".usd": "usd:open_usd",
    ".usda": "usd:open_usd",
    ".usdc": "usd:open_usd",
    ".usdz": "usd:open_usd",
    ".abc": "alembic:open_alembic",
}
_MESH_WRITERS = {".obj": "obj:write_obj", ".ply": "ply:write_ply"}

MESH_SUFFIXES = tuple(_MESH_READERS)
SEQUENCE_SUFFIXES = tuple(_SEQUENCE_READERS)


def read_mesh(path: str | Path) -> TriangleMesh:
    """Read one mesh: OBJ, PLY, STL, glTF/GLB, USD or Alembic (the last two at their first frame).

    Vertices keep the file's order and unit. Quads and n-gons are kept in ``polygons`` and split the same way every
    time (`Polygons.triangulate`). Several meshes in one file are joined in file order, with their node transforms.

    Raises
    ------
    InputError : no such file, a suffix that is not known, a damaged file
    MissingDependencyError : a package that only this format needs is not installed
    """
    path = Path(path)
    if path.is_dir():
        raise InputError("is a folder, but one mesh is wanted", where=path, remedy="give one file of it")
    read = _function(_MESH_READERS, path, "a mesh")
    _check_exists(path)
    return read(path)


def open_sequence(path: str | Path, *, fps: float | None = None) -> FrameSequence:
    """Open a take: a folder of numbered OBJ or PLY, ``.npy``, ``.npz``, PC2, MDD, Alembic, USD or animated glTF.

    Parameters
    ----------
    fps : frames a second, where the file does not say or says it wrong. An animated glTF is sampled at this rate; the
        other formats have frames of their own, which are never resampled.

    Raises
    ------
    InputError : no such file, no frames, a damaged file, gaps in the numbering, frames of another vertex count
    MissingDependencyError : a package that only this format needs is not installed
    """
    path = Path(path)
    checked_fps(fps, path)
    if path.is_dir():
        open_folder: Callable = _load("folder:open_folder")
        return open_folder(path, fps)
    open_file = _function(_SEQUENCE_READERS, path, "a take")
    _check_exists(path)
    return open_file(path, fps)


def write_mesh(path: str | Path, mesh: TriangleMesh) -> None:
    """Write one mesh as OBJ or binary PLY, with its polygons if it has any; reading it back gives the same bits."""
    write = _function(_MESH_WRITERS, Path(path), "a mesh to write")
    write(path, mesh)


def _function(table: dict[str, str], path: Path, what: str) -> Callable:
    entry = table.get(path.suffix.lower())
    if entry is None:
        _check_exists(path)
        suffix = f"'{path.suffix}'" if path.suffix else "a name without a suffix"
        raise InputError(f"{suffix} is not known as {what}", where=path, remedy=f"use one of {' '.join(table)}")
    return _load(entry)


def _load(entry: str) -> Callable:
    module, function = entry.split(":")
    return getattr(import_module(f"toolkit.meshio.{module}"), function)


def _check_exists(path: Path) -> None:
    if not path.exists():
        raise InputError("there is no such file", where=path, remedy="check the path")
