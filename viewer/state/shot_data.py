"""The shot as the viewer needs it: meshes, frames and what has been computed so far, read when first asked for."""

from __future__ import annotations

import logging
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio import FrameSequence, read_mesh
from toolkit.rendering.extras import Extras, load_extras
from toolkit.rendering.shots import reader_of
from toolkit.rigid import Similarity
from toolkit.shot import Shot
from toolkit.stabilisation import HeadMotion
from toolkit.stages.decompose import load_motion
from toolkit.stages.inputs import load_sequence
from toolkit.stages.register import load_pose
from viewer.state.cameras import Framing

__all__ = ["ShotData"]

log = logging.getLogger(__name__)


class ShotData:
    """Reads a shot folder. Arrays are memory-mapped; nothing of it is changed here.

    ``source`` and ``target`` are the meshes as in the user's files: landmarks and lines refer to those. After a stage
    was run, make a new one from the one ``before``.
    """

    def __init__(self, shot: Shot, before: ShotData | None = None) -> None:
        self.shot = shot
        # Reading meshes takes a second, in which the window would stand still; the user's files stay as they are.
        for name in ("source", "target") if before is not None and _same_files(shot, before.shot) else ():
            if name in vars(before):
                vars(self)[name] = vars(before)[name]
        self.has_result = self._has("result", "frames", "triangles")
        self.has_registration = self._has("register", "target_vertices", "distance", "pose")
        self.has_bases = self._has("bases", "weights")

    @cached_property
    def source(self) -> TriangleMesh:
        """The performer's reference."""
        return read_mesh(self.shot.config.source.reference)

    @cached_property
    def target(self) -> TriangleMesh:
        """The target's reference, on its own topology."""
        return read_mesh(self.shot.config.target.reference)

    @cached_property
    def sequence(self) -> FrameSequence:
        """The take."""
        return load_sequence(self.shot)

    @property
    def n_frames(self) -> int:
        """Frames of the take."""
        return self.sequence.n_frames

    @property
    def fps(self) -> float:
        """Frames a second; 30 where the take does not say."""
        return self.sequence.rate

    def source_frame(self, frame: int) -> NDArray[np.float32]:
        """One frame of the take ``(V, 3)``."""
        return self._read_source(frame)

    @cached_property
    def _read_source(self):  # type: ignore[no-untyped-def]
        return reader_of(self.sequence)

    @cached_property
    def result(self) -> NDArray[np.float32]:
        """The result ``(T, V, 3)``, memory-mapped; edits are in it if it was written with them."""
        return self.shot.array("result", "frames")

    @cached_property
    def registered(self) -> NDArray[np.float32]:
        """The target on the source's topology ``(V, 3)``, in its own place."""
        return np.array(self.shot.array("register", "target_vertices"), dtype=np.float32)

    @cached_property
    def distance(self) -> NDArray[np.float32]:
        """How far the registered surface is from the target's own, ``(V,)``; not a number where it has to guess."""
        distance = np.array(self.shot.array("register", "distance"), dtype=np.float32)
        interior = np.array(self.shot.array("register", "interior"), dtype=bool)
        distance[interior] = np.nan
        return distance

    @cached_property
    def interior(self) -> NDArray[np.bool_] | None:
        """Which vertices of the source's topology lie inside mouth and eyes, ``(V,)``; None before the registration."""
        return np.array(self.shot.array("register", "interior"), dtype=bool) if self.has_registration else None

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """Weights of the bases ``(T, K)``, as found in the take."""
        return np.array(self.shot.array("bases", "weights"))

    @cached_property
    def pose(self) -> Similarity | None:
        """From the source's pose and size to the target's place; None before the registration."""
        return load_pose(self.shot) if self.has_registration else None

    @cached_property
    def source_framing(self) -> Framing:
        """Where the performer's face is."""
        return Framing.of(self.source.vertices)

    @cached_property
    def target_framing(self) -> Framing:
        """Where the target's face is: as the registration says, or round all of it."""
        if self.pose is not None:
            return self.source_framing.moved(self.pose)
        return Framing.of(self.target.vertices)

    @cached_property
    def source_extras(self) -> Extras | None:
        """What rides with the performer's head, eyeballs for one; only to look at."""
        return self._extras(self.shot.config.source.extras, None)

    @cached_property
    def target_extras(self) -> Extras | None:
        """What rides with the target's head."""
        return self._extras(self.shot.config.target.extras, self.pose)

    def _extras(self, paths: tuple[Path, ...], pose: Similarity | None) -> Extras | None:
        still = HeadMotion.none(self.n_frames)
        try:
            motion = load_motion(self.shot) if self.has_result else still
            return load_extras(paths, motion.seen_from(pose) if pose is not None and self.has_result else motion)
        except (InputError, OSError) as error:
            log.warning("without the extras: %s", error)  # a picture less, nothing that the work needs
            return None

    def _has(self, stage: str, *names: str) -> bool:
        try:
            for name in names:
                self.shot.array(stage, name)
        except (InputError, OSError, ValueError):
            return False
        return True


def _same_files(one: Shot, other: Shot) -> bool:
    """Whether both name the same meshes."""
    a, b = one.config, other.config
    return (a.source.reference, a.target.reference) == (b.source.reference, b.target.reference)
