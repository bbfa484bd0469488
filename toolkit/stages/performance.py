"""The finished result of a shot as something that can be exported."""

from __future__ import annotations

import logging

import numpy as np

from toolkit.errors import InputError
from toolkit.export import Performance
from toolkit.meshio.sequence import USUAL_FPS
from toolkit.shot import Shot
from toolkit.stages.decompose import load_motion
from toolkit.stages.inputs import load_mesh
from toolkit.stages.register import load_pose
from toolkit.stages.run import current_key

__all__ = ["load_performance"]

log = logging.getLogger(__name__)


def load_performance(shot: Shot) -> Performance:
    """The retargeted performance, frames memory-mapped, in the target's unit and place.

    The morphs are whole frames of the result, those that were chosen as bases, with the head's motion taken out: a glTF
    then carries the wrinkles of these frames, too. After edits they are the edited bases with the same frames' details.
    """
    if not shot.is_current("result", current_key(shot, "result")):
        raise InputError(
            "the result is missing or older than the shot's files and parameters",
            where=shot.path,
            remedy=f"run scripts/run_all.py {shot.path}",
        )
    source = load_mesh(shot, "source")
    frames = shot.array("result", "frames")
    motion = load_motion(shot).seen_from(load_pose(shot))
    chosen = np.array(shot.array("bases", "frames"))
    edited = "weights.npy" in (shot.manifest("result") or {})["files"]
    shapes = shot.array("result", "morphs") if edited else frames[chosen]
    placed = shapes.astype(np.float64) - motion.translations[chosen][:, None]
    fps = (shot.manifest("inputs") or {}).get("numbers", {}).get("fps")
    if fps is None:
        log.warning("the take says no frame rate; %g frames a second are assumed (fps in shot.toml)", USUAL_FPS)
    return Performance(
        triangles=source.triangles,
        polygons=source.polygons,
        rest=np.array(shot.array("register", "target_vertices")),
        morphs=np.einsum("kji,kvj->kvi", motion.rotations[chosen], placed),
        weights=np.array(shot.array("result" if edited else "bases", "weights")),
        rotations=motion.rotations,
        translations=motion.translations,
        read=lambda start, stop: np.array(frames[start:stop]),
        n_frames=len(frames),
        fps=float(fps or USUAL_FPS),
        name=shot.path.resolve().name,
        morph_names=tuple(f"frame_{index:04d}" for index in chosen),
    )
