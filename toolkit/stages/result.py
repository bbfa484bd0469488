"""Stage "result": details carried over, every frame built, the head's motion put back."""

from __future__ import annotations

import numpy as np

from toolkit.coating_details import CoatingDetails
from toolkit.details import Reconstruction, reconstruct_sequence
from toolkit.progress import Progress
from toolkit.shot import Shot, StageFolder
from toolkit.stages.decompose import load_motion, source_decomposer
from toolkit.stages.register import load_pose
from toolkit.stages.transfer import target_decomposer

__all__ = ["open_reconstruction", "work"]


def work(shot: Shot, folder: StageFolder, progress: Progress) -> None:
    """Write ``frames.npy`` and ``triangles.npy``."""
    details = shot.array("decompose", "details")
    reconstruction = open_reconstruction(shot)
    frames = folder.create("frames", details.shape)
    reconstruct_sequence(reconstruction, details, frames, progress)
    folder.save("triangles", np.array(shot.array("inputs", "source_triangles")))
    folder.numbers |= {"frames": len(frames), "vertices": frames.shape[1], "unit": "the target's"}


def open_reconstruction(shot: Shot) -> Reconstruction:
    """What builds any frame of the result on demand."""
    target = target_decomposer(shot)
    gain = np.array(shot.array("transfer", "gain"))
    coating = None
    if shot.config.details.method == "coating":
        deltas, details = shot.array("decompose", "smooth_deltas"), shot.array("decompose", "details")
        coating = CoatingDetails(source_decomposer(shot), target, deltas, details, gain, shot.config.details.screening)
    return Reconstruction(
        target,
        np.array(shot.array("transfer", "bases")),
        np.array(shot.array("bases", "weights")),
        gain,
        load_motion(shot),
        load_pose(shot),
        coating,
    )
