"""Shots for the benchmarks: samples with known answers, targets on the true correspondence or to be registered."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from data.samples import PerformerPaths, SamplePaths
from data.targets import Truth
from toolkit.mesh import TriangleMesh
from toolkit.meshio import FrameSequence, open_sequence, read_mesh, write_mesh
from toolkit.progress import Progress
from toolkit.shot import Shot
from toolkit.shot.config import ShotConfig, SourceInput, TargetInput, save_config
from toolkit.stabilisation import HeadMotion
from toolkit.stages import run_stages
from toolkit.stages.register import load_pose

__all__ = [
    "Take",
    "face_height",
    "known_answer",
    "make_shot",
    "run_with",
    "sample_take",
    "stabilised",
    "still_take",
    "true_target",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Take:
    """A source performance on disk with what made it.

    ``reference`` and ``frames`` are the files, ``weights`` (T, 52), ``motion`` the head's.
    """

    reference: Path
    frames: Path
    weights: Array
    motion: HeadMotion

    def mesh(self) -> TriangleMesh:
        """The reference."""
        return read_mesh(self.reference)

    def sequence(self) -> FrameSequence:
        """The frames."""
        return open_sequence(self.frames)


def sample_take(performer: PerformerPaths, folder: Path, count: int | None, *, wrinkles: bool) -> Take:
    """``count`` evenly spaced frames of the sample performance (all by default).

    Without ``wrinkles`` it is the same performance without relief: the known answers have none, so that the two can be
    compared on the whole surface.
    """
    folder.mkdir(parents=True, exist_ok=True)
    weights, frames = np.load(performer.weights), np.load(performer.frames, mmap_mode="r")
    with np.load(performer.head_motion) as held:
        motion = HeadMotion(held["rotations"], held["translations"])
    chosen = np.unique(np.linspace(0, len(weights) - 1, min(count or len(weights), len(weights))).round().astype(int))
    motion, weights = HeadMotion(motion.rotations[chosen], motion.translations[chosen]), weights[chosen]
    path, reference = folder / "frames.npy", folder / "reference.ply"
    mesh = read_mesh(performer.reference)
    if wrinkles:
        np.save(path, frames[chosen])
    else:
        shapes, subdivide = np.load(performer.shapes), sp.load_npz(performer.subdivision)
        out = np.lib.format.open_memmap(path, mode="w+", dtype=np.float32, shape=(len(chosen), mesh.n_vertices, 3))
        for t, row in enumerate(weights):
            points = subdivide @ (shapes["neutral"] + np.tensordot(row, shapes["offsets"], 1))
            out[t] = points @ motion.rotations[t].T + motion.translations[t]
        out.flush()
        mesh = mesh.with_vertices(subdivide @ shapes["neutral"])
    write_mesh(reference, TriangleMesh(mesh.vertices, mesh.triangles))
    return Take(reference, path, weights, motion)


def still_take(take: Take, folder: Path, frame: int, count: int) -> Take:
    """One frame of a take, held."""
    folder.mkdir(parents=True, exist_ok=True)
    held = take.sequence().read(frame, frame + 1)
    np.save(folder / "frames.npy", np.repeat(held, count, axis=0))
    motion = HeadMotion(
        np.repeat(take.motion.rotations[frame : frame + 1], count, axis=0),
        np.repeat(take.motion.translations[frame : frame + 1], count, axis=0),
    )
    return Take(
        take.reference, folder / "frames.npy", np.repeat(take.weights[frame : frame + 1], count, axis=0), motion
    )


def make_shot(folder: Path, take: Take, target: Path, lines: Path, landmarks: Path | None = None) -> Shot:
    """A shot folder, made anew."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    save_config(
        folder / "shot.toml",
        ShotConfig(SourceInput(take.reference.resolve(), take.frames.resolve(), 30.0), TargetInput(target.resolve())),
    )
    shutil.copy(lines, folder / "feature_lines.json")
    if landmarks is not None:
        shutil.copy(landmarks, folder / "landmarks.json")
    return Shot(folder)


def run_with(shot: Shot, progress: Progress, **tables: dict[str, Any]) -> Shot:
    """Run the whole shot with parameters that differ from the defaults, e.g. ``transfer={"contacts": False}``."""
    config = Shot(shot.path).config
    default = ShotConfig(config.source, config.target)
    changed = {name: replace(getattr(default, name), **values) for name, values in tables.items()}
    save_config(shot.path / "shot.toml", replace(default, **changed))
    again = Shot(shot.path)
    run_stages(again, progress=progress)
    return again


def true_target(samples: SamplePaths, name: str, reference: TriangleMesh, folder: Path) -> Path:
    """A file of the target's true shape on the source's topology: nothing is left to register."""
    path = folder / f"{name}.ply"
    write_mesh(path, TriangleMesh(samples.truth(name).shape(np.zeros(52)), reference.triangles))
    return path


def known_answer(shot: Shot, truth: Truth, take: Take) -> Iterator[Array]:
    """Frames ``(V, 3)`` of the true answer where the result is: with the head's motion, seen from the target."""
    placed = take.motion.seen_from(load_pose(shot))
    for t, weights in enumerate(take.weights):
        yield truth.shape(weights) @ placed.rotations[t].T + placed.translations[t]


def stabilised(shot: Shot, take: Take) -> Iterator[Array]:
    """Frames ``(V, 3)`` of the result without the head's motion."""
    placed = take.motion.seen_from(load_pose(shot))
    for t, frame in enumerate(shot.array("result", "frames")):
        yield (frame - placed.translations[t]) @ placed.rotations[t]


def face_height(vertices: NDArray[np.floating], landmarks: dict[str, int]) -> float:
    """From under the chin to the top of the forehead, in mesh units."""
    return float(np.linalg.norm(vertices[landmarks["forehead_high"]] - vertices[landmarks["menton"]]))
