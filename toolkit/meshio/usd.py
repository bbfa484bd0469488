"""USD: every mesh of the stage, joined, with the transforms above it, at any of its frames."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio.joined import Piece, join_faces, join_points, reverse_faces, transform_points
from toolkit.meshio.optional import require
from toolkit.meshio.sequence import FrameSequence

__all__ = ["open_usd", "read_usd"]

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Scene:
    """An open stage and its meshes; the stage must outlive its prims."""

    path: Path
    stage: Any
    meshes: list[Any]

    def names(self) -> list[str]:
        return [str(mesh.GetPath()) for mesh in self.meshes]

    def points(self, time: float | None) -> list[NDArray[np.floating]]:
        """World positions of each mesh; ``time`` None is the earliest there is."""
        from pxr import Usd, UsdGeom

        code = Usd.TimeCode.EarliestTime() if time is None else Usd.TimeCode(time)
        cache = UsdGeom.XformCache(code)
        return [transform_points(_points(mesh, code), _world(cache, mesh)) for mesh in self.meshes]

    def mesh(self, time: float | None) -> TriangleMesh:
        """Join the meshes, with counter-clockwise faces whatever the file's orientation."""
        from pxr import Usd, UsdGeom

        code = Usd.TimeCode.EarliestTime() if time is None else Usd.TimeCode(time)
        cache = UsdGeom.XformCache(code)
        pieces = []
        for mesh, points in zip(self.meshes, self.points(time), strict=True):
            counts = np.array(mesh.GetFaceVertexCountsAttr().Get(code) or [], dtype=np.int64)
            indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(code) or [], dtype=np.int64)
            left_handed = mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded
            mirrored = np.linalg.det(_world(cache, mesh)[:3, :3]) < 0
            if left_handed != mirrored and int(counts.sum()) == len(indices):
                indices = reverse_faces(counts, indices)
            pieces.append(Piece(str(mesh.GetPath()), points, counts, indices))
        return join_faces(pieces, self.path)


def read_usd(path: str | Path) -> TriangleMesh:
    """Read the meshes of a USD file (.usd, .usda, .usdc, .usdz) at its earliest time, joined in stage order.

    Positions stay in the file's unit and axes; the log says which they are.
    """
    return _open(Path(path)).mesh(None)


def open_usd(path: Path, fps: float | None) -> FrameSequence:
    """Open a USD file as a take: a frame at each of its time samples, and where writers left out samples between."""
    scene = _open(path)
    times = _frame_times(scene)
    first = scene.mesh(times[0])
    names, sizes = scene.names(), [len(points) for points in scene.points(times[0])]

    def read_block(start: int, stop: int) -> NDArray[np.float32]:
        block = np.zeros((stop - start, first.n_vertices, 3), dtype=np.float32)
        for row, frame in enumerate(range(start, stop)):
            block[row] = join_points(names, scene.points(times[frame]), sizes, frame, path)
        return block

    spacing = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 1.0
    rate = fps or round(scene.stage.GetTimeCodesPerSecond() / spacing, 3)
    return FrameSequence(len(times), first.n_vertices, rate, str(path), read_block, first.triangles)


def _open(path: Path) -> _Scene:
    require("usd", path)
    from pxr import Tf, Usd, UsdGeom

    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        what = "cannot be read as a USD file"
        raise InputError(what, where=path, remedy="it is damaged or cut short, export it again") from error
    axis, metres = UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)
    logger.info("%s: %s is up, a unit is %g m; positions are taken as they are", path, axis, metres)
    prims = stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))
    meshes = [UsdGeom.Mesh(prim) for prim in prims if prim.IsA(UsdGeom.Mesh) and _is_rendered(prim)]
    if not meshes:
        raise InputError("holds no mesh", where=path, remedy="export the face's mesh into it")
    return _Scene(path, stage, meshes)


def _is_rendered(prim: Any) -> bool:
    from pxr import UsdGeom, UsdSkel

    if prim.HasAPI(UsdSkel.BindingAPI):
        logger.warning("%s: its skeleton or blend shapes are not evaluated, bake them to points", prim.GetPath())
    return UsdGeom.Imageable(prim).ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)


def _points(mesh: Any, code: Any) -> NDArray[np.floating]:
    points = mesh.GetPointsAttr().Get(code)
    return np.zeros((0, 3), dtype=np.float32) if points is None else np.array(points).reshape(-1, 3)


def _world(cache: Any, mesh: Any) -> NDArray[np.float64]:
    return np.array(cache.GetLocalToWorldTransform(mesh.GetPrim()), dtype=np.float64)


def _frame_times(scene: _Scene) -> NDArray[np.float64]:
    """Time codes of the frames: the samples, and the grid between them where all samples lie on one."""
    from pxr import UsdGeom

    samples: set[float] = set()
    for mesh in scene.meshes:
        samples |= set(mesh.GetPointsAttr().GetTimeSamples())
        prim = mesh.GetPrim()
        while prim and not prim.IsPseudoRoot():
            if prim.IsA(UsdGeom.Xformable):
                samples |= set(UsdGeom.Xformable(prim).GetTimeSamples())
            prim = prim.GetParent()
    if not samples:
        raise InputError("holds no animation", where=scene.path, remedy="export it with time samples")
    times = np.array(sorted(samples))
    if len(times) < 3:
        return times
    step = np.diff(times).min()
    n_steps = round((times[-1] - times[0]) / step)
    off_grid = np.abs((times - times[0]) / step - np.round((times - times[0]) / step)).max()
    if off_grid > 1e-3:
        logger.warning("%s: its %d time samples are unevenly spaced, each is taken as a frame", scene.path, len(times))
        return times
    grid = times[0] + np.arange(n_steps + 1) * step
    grid[np.round((times - times[0]) / step).astype(int)] = times  # the samples themselves, not a rounding beside them
    return grid
