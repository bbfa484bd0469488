"""Alembic: one polygon mesh with exact float32 positions a frame."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from toolkit.export.performance import Performance
from toolkit.meshio.aside import written_aside
from toolkit.meshio.joined import reverse_faces
from toolkit.meshio.optional import require
from toolkit.progress import Progress

__all__ = ["write_alembic"]


def write_alembic(performance: Performance, path: Path, progress: Progress) -> None:
    """Write an Ogawa archive. Faces are turned to Alembic's clockwise winding, so that programs see them outward."""
    require("alembic", path)
    import imath
    from alembic3d import Abc, AbcCoreAbstract, AbcGeom

    polygons = performance.mesh.faces
    corners = np.ascontiguousarray(reverse_faces(polygons.counts, polygons.indices), dtype=np.int32)
    counts = np.ascontiguousarray(polygons.counts, dtype=np.int32)
    with written_aside(path, room=performance.n_bytes) as temporary:
        archive = Abc.OArchive(str(temporary))
        sampling = archive.addTimeSampling(AbcCoreAbstract.TimeSampling(1.0 / performance.fps, 0.0))
        name = re.sub(r"[^\w-]+", "_", performance.name) or "performance"
        schema = AbcGeom.OPolyMesh(archive.getTop(), name, sampling).getSchema()
        sample = AbcGeom.OPolyMeshSchemaSample()
        sample.setFaceIndices(imath.IntArrayFromBuffer(corners))
        sample.setFaceCounts(imath.IntArrayFromBuffer(counts))
        # One array for all frames, filled through its memory: a sample keeps every array that it was ever given.
        positions = imath.V3fArray(performance.n_vertices)
        sample.setPositions(positions)
        view = np.asarray(memoryview(positions))
        for start, stop in performance.blocks():
            for frame in performance.read(start, stop):
                view[:] = frame
                schema.set(sample)
            progress("writing Alembic", stop, performance.n_frames)
        del schema, archive  # the archive is complete when its last handle goes
