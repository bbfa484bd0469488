"""Stage "decompose": the head's motion, the smoothed frames and the motion details of the performance."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from toolkit.blocks import block_size, map_blocks
from toolkit.decomposition import Decomposer, decompose_block
from toolkit.meshio import FrameSequence
from toolkit.progress import Progress
from toolkit.shot import Shot, StageFolder
from toolkit.stabilisation import HeadMotion, fit_head_motion
from toolkit.stages.blocks import Fill, MapBlocks, StageBlocks
from toolkit.stages.inputs import load_mesh, load_sequence

__all__ = ["load_motion", "source_decomposer", "work"]


def work(shot: Shot, folder: StageFolder, progress: Progress, map_blocks: MapBlocks = map_blocks) -> None:
    """Stabilise and split every frame."""
    sequence, mesh = load_sequence(shot), load_mesh(shot, "source")
    with ThreadPoolExecutor(1) as pool:  # neither needs the other, and both leave a processor idle
        prepared = pool.submit(Decomposer, mesh, shot.config.smoothing)
        motion = fit_head_motion(sequence, mesh.vertices, enabled=shot.config.stabilise.enabled, progress=progress)
    decomposer = prepared.result()
    folder.save("rest_smooth", decomposer.rest.smooth)
    folder.save("neighbour", decomposer.rest.neighbour)
    folder.save("rotations", motion.rotations)
    folder.save("translations", motion.translations)
    shape = (sequence.n_frames, sequence.n_vertices, 3)
    folder.create("smooth_deltas", shape)
    folder.create("details", shape)
    folder.create("detail_energy", shape[:1], np.float64)
    arrays = ("smooth_deltas", "details", "detail_energy")
    fill = partial(_decompose, sequence, decomposer, motion)
    blocks, size = StageBlocks(arrays, _open_blocks, shot.path, folder.path, fill), block_size(sequence.n_vertices)
    map_blocks(blocks, sequence.n_frames, size, what="decomposing frames", progress=progress)
    cosine = np.clip((np.trace(motion.rotations, axis1=1, axis2=2) - 1) / 2, -1, 1)
    folder.numbers |= {
        "head_turns_degrees": float(np.degrees(np.arccos(cosine)).max()),
        "head_moves": float(np.sqrt((motion.translations**2).sum(axis=1)).max()),
        "smoothing_steps": shot.config.smoothing.resolved(decomposer.mesh).steps,
    }


def source_decomposer(shot: Shot) -> Decomposer:
    """The source's smoothing and local frames, as the stage used them."""
    return _decomposer(shot, shot.array("decompose", "neighbour"))


def load_motion(shot: Shot) -> HeadMotion:
    """The head's motion that was taken out."""
    rotations, translations = shot.array("decompose", "rotations"), shot.array("decompose", "translations")
    return HeadMotion(np.array(rotations), np.array(translations))


def _open_blocks(shot_path: Path, written: Path) -> Fill:
    """The stage's work on blocks for another process, from what the stage has ``written`` so far."""
    shot, folder = Shot(shot_path), StageFolder(written)
    motion = HeadMotion(np.array(folder.array("rotations")), np.array(folder.array("translations")))
    return partial(_decompose, load_sequence(shot), _decomposer(shot, folder.array("neighbour")), motion)


def _decomposer(shot: Shot, neighbour: np.ndarray) -> Decomposer:
    return Decomposer(load_mesh(shot, "source"), shot.config.smoothing, np.array(neighbour))


def _decompose(
    sequence: FrameSequence,
    decomposer: Decomposer,
    motion: HeadMotion,
    start: int,
    stop: int,
    smooth_deltas: np.ndarray,
    details: np.ndarray,
    energy: np.ndarray,
) -> None:
    """One block; ``energy`` (B,) is the RMS length of each frame's motion detail: how wrinkled the face is."""
    decompose_block(sequence, decomposer, motion, start, stop, smooth_deltas, details)
    energy[:] = [np.sqrt(np.vdot(frame, frame) / len(frame)) for frame in details]
