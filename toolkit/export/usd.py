"""USD: one mesh with exact float32 points, a time sample a frame."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from toolkit.export.performance import Performance
from toolkit.meshio.aside import written_aside
from toolkit.meshio.optional import require
from toolkit.progress import Progress

__all__ = ["write_usd"]


def write_usd(performance: Performance, path: Path, progress: Progress) -> None:
    """Write a stage with the original polygons, not to be subdivided; the rest pose is the default value.

    A ``.usdc`` or ``.usd`` is binary and exact; a ``.usda`` is text, for reading by eye. Time codes are frame numbers
    from 0, at the performance's frame rate.
    """
    require("usd", path)
    from pxr import Usd

    with written_aside(path, room=performance.n_bytes) as temporary:
        stage = Usd.Stage.CreateNew(str(temporary))
        _describe_stage(stage, performance)
        mesh = _define_mesh(stage, performance)
        for start, stop in performance.blocks():
            _write_block(mesh, performance, start, stop)
            stage.Save()  # moves the block from memory to the file
            progress("writing USD", stop, performance.n_frames)
        del mesh, stage


def _describe_stage(stage: Any, performance: Performance) -> None:
    from pxr import UsdGeom

    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    if performance.metres_per_unit is not None:
        UsdGeom.SetStageMetersPerUnit(stage, performance.metres_per_unit)
    stage.SetTimeCodesPerSecond(performance.fps)
    stage.SetFramesPerSecond(performance.fps)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(performance.n_frames - 1)


def _define_mesh(stage: Any, performance: Performance) -> Any:
    from pxr import Tf, UsdGeom, Vt

    root = UsdGeom.Xform.Define(stage, f"/{Tf.MakeValidIdentifier(performance.name)}")
    stage.SetDefaultPrim(root.GetPrim())
    mesh = UsdGeom.Mesh.Define(stage, root.GetPath().AppendChild("mesh"))
    polygons = performance.mesh.faces
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(polygons.counts.astype(np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(polygons.indices.astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    rest = np.ascontiguousarray(performance.rest, dtype=np.float32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(rest))
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([rest.min(axis=0), rest.max(axis=0)])))
    return mesh


def _write_block(mesh: Any, performance: Performance, start: int, stop: int) -> None:
    from pxr import Vt

    points, extent = mesh.GetPointsAttr(), mesh.GetExtentAttr()
    for frame, positions in enumerate(performance.read(start, stop), start):
        single = np.ascontiguousarray(positions, dtype=np.float32)
        points.Set(Vt.Vec3fArray.FromNumpy(single), frame)
        extent.Set(Vt.Vec3fArray.FromNumpy(np.stack([single.min(axis=0), single.max(axis=0)])), frame)
