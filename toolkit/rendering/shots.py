"""A shot as views: the performance and its result, framed alike."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from toolkit.meshio import FrameSequence
from toolkit.rendering.extras import load_extras
from toolkit.rendering.regions import face_vertices
from toolkit.rendering.shading import BONE, SKIN
from toolkit.rendering.takes import View, choose_frames
from toolkit.rigid import Similarity
from toolkit.shot import Shot
from toolkit.stabilisation import HeadMotion
from toolkit.stages.decompose import load_motion
from toolkit.stages.inputs import load_landmark_pairs, load_mesh, load_sequence
from toolkit.stages.register import load_pose

__all__ = ["ShotViews", "expressive_frames", "open_views"]

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class ShotViews:
    """``source`` and ``target`` (the result) on one topology, ``landmarks`` name to vertex, ``fps`` of the take.

    ``face_heights`` of source and target, in their own units, are what relative numbers refer to; ``motions`` the
    head's motion of each.
    """

    source: View
    target: View
    landmarks: dict[str, int]
    fps: float
    face_heights: tuple[float, float]
    motions: tuple[HeadMotion, HeadMotion]

    def steady(self) -> tuple[View, View]:
        """Source and target without the head's motion, so that a close-up stays on its part of the face."""
        return _held_still(self.source, self.motions[0]), _held_still(self.target, self.motions[1])


def open_views(shot: Shot, *, forward: Vector = (0.0, 0.0, 1.0), up: Vector = (0.0, 1.0, 0.0)) -> ShotViews:
    """Open a shot whose stages have been run.

    ``forward`` (out of the face) and ``up`` are the source's axes; the registration says where they lie on the target.
    Raises InputError where the result is missing.
    """
    result = shot.array("result", "frames")
    source, pose, sequence = load_mesh(shot, "source"), load_pose(shot), load_sequence(shot)
    marks = load_landmark_pairs(shot)
    landmarks = {name: int(vertex) for name, vertex in zip(marks.names, marks.source, strict=True)}
    focus = face_vertices(source.vertices, landmarks)
    shown = source.vertices if focus is None else source.vertices[focus]
    height = float(np.ptp(shown @ np.asarray(up) / np.linalg.norm(up)))
    motion = load_motion(shot)
    motions = (motion, motion.seen_from(pose))
    performance = View(
        "source",
        source.triangles,
        source.vertices,
        sequence.n_frames,
        reader_of(sequence),
        SKIN,
        forward,
        up,
        focus,
        load_extras(shot.config.source.extras, motions[0]),
    )
    retargeted = replace(
        performance,
        label=shot.path.resolve().name,
        rest=np.array(shot.array("register", "target_vertices")),
        frame=lambda t: np.array(result[t]),
        material=BONE,
        forward=_turned(pose, forward),
        up=_turned(pose, up),
        extras=load_extras(shot.config.target.extras, motions[1]),
    )
    heights = (height, height * pose.scale)
    return ShotViews(performance, retargeted, landmarks, sequence.rate, heights, motions)


def expressive_frames(shot: Shot, count: int) -> list[int]:
    """Choose ``count`` frames of the take that differ most in shape, the calmest among them.

    Displacements are divided by the square root of their size: else an open jaw outweighs every blink and frown.
    """
    deltas = shot.array("decompose", "smooth_deltas")
    shapes = np.array(deltas[:, :: max(1, deltas.shape[1] // 500)]).reshape(len(deltas), -1)
    size = np.linalg.norm(shapes, axis=1, keepdims=True)
    evened = shapes / np.sqrt(np.maximum(size, 1e-3 * float(size.max(initial=1e-30))))
    return choose_frames(evened, count, first=int(np.argmin(size)))


def reader_of(sequence: FrameSequence) -> Callable[[int], NDArray[np.floating]]:
    """Read single frames; one at a time, since not every format's reader can be shared between threads."""
    lock = threading.Lock()

    def frame(index: int) -> NDArray[np.floating]:
        with lock:
            return sequence.read(index, index + 1)[0]

    return frame


def _held_still(view: View, motion: HeadMotion) -> View:
    def frame(index: int) -> NDArray[np.floating]:
        return np.asarray((view.frame(index) - motion.translations[index]) @ motion.rotations[index])

    extras = view.extras and replace(view.extras, motion=HeadMotion.none(view.n_frames))
    return replace(view, frame=frame, extras=extras)


def _turned(pose: Similarity, direction: Vector) -> Vector:
    x, y, z = (float(c) for c in pose.rotation @ np.asarray(direction))
    return x, y, z
