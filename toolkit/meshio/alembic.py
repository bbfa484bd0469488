"""Alembic: every polygon mesh of the archive, joined, with the transforms above it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio.joined import Piece, frame_rate_of, join_faces, join_points, reverse_faces, transform_points
from toolkit.meshio.optional import require
from toolkit.meshio.sequence import FrameSequence

__all__ = ["open_alembic", "read_alembic"]


@dataclass(frozen=True)
class _Object:
    """One mesh schema and the transform schemas above it, the nearest first."""

    name: str
    schema: Any
    transforms: list[Any]

    def points(self, time: float) -> NDArray[np.floating]:
        """Points (n, 3) at a time in seconds, in the scene's place."""
        points = np.array(memoryview(self.schema.getValue(_at(time)).getPositions()))
        return transform_points(points, self._world(time))

    def piece(self, time: float) -> Piece:
        """Points and faces at a time in seconds, in the scene's place."""
        sample = self.schema.getValue(_at(time))
        counts = np.array(memoryview(sample.getFaceCounts()))
        indices = np.array(memoryview(sample.getFaceIndices()))
        # Alembic's winding is clockwise seen from outside, ours counter-clockwise; a mirroring transform turns it.
        mirrored = np.linalg.det(self._world(time)[:3, :3]) < 0
        if not mirrored and int(counts.sum()) == len(indices):
            indices = reverse_faces(counts, indices)
        return Piece(self.name, self.points(time), counts, indices)

    def _world(self, time: float) -> NDArray[np.float64]:
        world = np.eye(4)
        for transform in self.transforms:
            sample = transform.getValue(_at(time))
            world = world @ np.array([list(row) for row in sample.getMatrix()], dtype=np.float64)
            if not sample.getInheritsXforms():
                break
        return world


def read_alembic(path: str | Path) -> TriangleMesh:
    """Read the polygon meshes of an Alembic file at its first frame, joined in the order of the archive."""
    require("alembic", path)
    with _reading(path):
        objects = _objects(Path(path))
        return _mesh(objects, _times(objects)[0], path)


def open_alembic(path: Path, fps: float | None) -> FrameSequence:
    """Open an Alembic file as a take: its frames are the samples of the object that has the most."""
    require("alembic", path)
    with _reading(path):
        objects = _objects(path)
        times = _times(objects)
        mesh = _mesh(objects, times[0], path)
        names = [item.name for item in objects]
        sizes = [len(item.points(times[0])) for item in objects]

    def read_block(start: int, stop: int) -> NDArray[np.float32]:
        block = np.zeros((stop - start, mesh.n_vertices, 3), dtype=np.float32)
        for row, frame in enumerate(range(start, stop)):
            with _reading(path):
                points = [item.points(times[frame]) for item in objects]
            block[row] = join_points(names, points, sizes, frame, path)
        return block

    rate = fps or frame_rate_of(times)
    if fps is None and rate == 1.0:
        rate = None  # one second a sample is Alembic's stand-in where the writer gave no time
    return FrameSequence(len(times), mesh.n_vertices, rate, str(path), read_block, mesh.triangles)


def _mesh(objects: list[_Object], time: float, path: str | Path) -> TriangleMesh:
    return join_faces([item.piece(time) for item in objects], path)


def _objects(path: Path) -> list[_Object]:
    from alembic3d import Abc

    objects = list(_walk(Abc.IArchive(str(path)).getTop(), [], ""))
    if not objects:
        raise InputError("holds no polygon mesh", where=path, remedy="export the face's mesh into it")
    return objects


@contextmanager
def _reading(path: str | Path) -> Iterator[None]:
    """Turn what the library raises on a damaged archive into a sentence."""
    try:
        yield
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1:] or ["unknown reason"]
        what = f"cannot be read as an Alembic file ({reason[0].strip()})"
        raise InputError(what, where=path, remedy="it is damaged or cut short, export it again") from error


def _walk(parent: Any, transforms: list[Any], prefix: str) -> Iterator[_Object]:
    from alembic3d import AbcGeom

    for child in parent.children:
        header, name = child.getHeader(), child.getName()
        above = transforms
        if AbcGeom.IXform.matches(header):
            above = [AbcGeom.IXform(parent, name).getSchema(), *transforms]
        for kind in (AbcGeom.IPolyMesh, AbcGeom.ISubD):
            if kind.matches(header):
                yield _Object(f"{prefix}/{name}", kind(parent, name).getSchema(), transforms)
        yield from _walk(child, above, f"{prefix}/{name}")


def _times(objects: list[_Object]) -> NDArray[np.float64]:
    schemas = [schema for item in objects for schema in (item.schema, *item.transforms)]
    longest = max(schemas, key=lambda schema: schema.getNumSamples())
    sampling = longest.getTimeSampling()
    return np.array([sampling.getSampleTime(i) for i in range(longest.getNumSamples())] or [0.0], dtype=np.float64)


def _at(time: float) -> Any:
    from alembic3d import Abc

    return Abc.ISampleSelector(float(time))
