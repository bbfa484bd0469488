"""Stage "result": details carried over, every frame built, the head's motion put back."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from toolkit.blocks import block_size, map_blocks
from toolkit.coating_details import CoatingDetails
from toolkit.decomposition import Decomposer
from toolkit.details import Reconstruction
from toolkit.progress import Progress
from toolkit.shot import Shot, StageFolder
from toolkit.stages.blocks import Fill, MapBlocks, StageBlocks
from toolkit.stages.decompose import load_motion, source_decomposer
from toolkit.stages.register import load_pose
from toolkit.stages.transfer import target_decomposer

__all__ = ["open_reconstruction", "work"]


def work(shot: Shot, folder: StageFolder, progress: Progress, map_blocks: MapBlocks = map_blocks) -> None:
    """Write ``frames.npy`` and ``triangles.npy``."""
    shape = shot.array("decompose", "details").shape
    folder.create("frames", shape)
    blocks = StageBlocks(("frames",), _open_blocks, shot.path, folder.path, _open_blocks(shot.path, folder.path))
    map_blocks(blocks, shape[0], block_size(shape[1]), what="building frames", progress=progress)
    folder.save("triangles", np.array(shot.array("inputs", "source_triangles")))
    folder.numbers |= {"frames": shape[0], "vertices": shape[1], "unit": "the target's"}


def _open_blocks(shot_path: Path, written: Path) -> Fill:
    """The stage's work on blocks, for this process or another."""
    shot = Shot(shot_path)
    details, reconstruction = shot.array("decompose", "details"), open_reconstruction(shot)

    def fill(start: int, stop: int, frames: np.ndarray) -> None:
        reconstruction.frames(start, stop, np.ascontiguousarray(details[start:stop]), frames)

    return fill


def open_reconstruction(shot: Shot, target: Decomposer | None = None) -> Reconstruction:
    """What builds any frame of the unedited result on demand; ``target`` if it is decomposed already."""
    target = target or target_decomposer(shot)
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
