"""Stage "result": details carried over, edits applied, every frame built, the head's motion put back.

With edits the folder also holds ``edits.json``, what each edit is and came to; ``weights.npy`` (T, K), the edited
weights; ``moved.npy`` (T,), how far each frame moved at most; ``morphs.npy`` (K, V, 3), the edited bases as whole
frames.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.blocks import block_size, map_blocks
from toolkit.coating_details import CoatingDetails
from toolkit.decomposition import Decomposer
from toolkit.details import Reconstruction
from toolkit.progress import Progress
from toolkit.shot import Shot, StageFolder
from toolkit.shot.journal import Edit, Journal
from toolkit.stages.blocks import Fill, MapBlocks, StageBlocks
from toolkit.stages.decompose import load_motion, source_decomposer
from toolkit.stages.register import load_pose
from toolkit.stages.transfer import target_decomposer

if TYPE_CHECKING:
    from toolkit.editing.applied import AppliedEdits

__all__ = ["active_edits", "open_reconstruction", "work"]

_RECORD = "edits.json"


def work(
    shot: Shot,
    folder: StageFolder,
    progress: Progress,
    map_blocks: MapBlocks = map_blocks,
    edits: AppliedEdits | None = None,
) -> None:
    """Write the frames and triangles; ``edits`` if they are solved already, else those of the journal are."""
    active = active_edits(shot)
    if edits is None and active:
        from toolkit.editing.applied import apply_edits  # it builds on the stages

        edits = apply_edits(shot, active, progress)
    if edits is not None and edits.record:
        _save_edits(shot, folder, edits)
    shape = shot.array("decompose", "details").shape
    folder.create("frames", shape)
    fill = _fill(shot, edits.reconstruction if edits is not None else open_reconstruction(shot))
    blocks = StageBlocks(("frames",), _open_blocks, shot.path, folder.path, fill)
    map_blocks(blocks, shape[0], block_size(shape[1]), what="building frames", progress=progress)
    folder.save("triangles", np.array(shot.array("inputs", "source_triangles")))
    folder.numbers |= {"frames": shape[0], "vertices": shape[1], "unit": "the target's"}


def _open_blocks(shot_path: Path, written: Path) -> Fill:
    """The stage's work on blocks in another process, with the edits that the stage has written down."""
    shot = Shot(shot_path)
    if not (written / _RECORD).exists():
        return _fill(shot, open_reconstruction(shot))
    from toolkit.editing.applied import apply_edits

    record = json.loads((written / _RECORD).read_text(encoding="utf-8"))
    edits = [Edit(one["number"], one["kind"], one["data"]) for one in record["edits"]]
    return _fill(shot, apply_edits(shot, edits).reconstruction)


def _fill(shot: Shot, reconstruction: Reconstruction) -> Fill:
    def fill(start: int, stop: int, frames: np.ndarray) -> None:
        # Mapped for this block alone: what was read through a map counts as the process's memory until it goes.
        details = shot.array("decompose", "details")[start:stop]
        reconstruction.frames(start, stop, np.ascontiguousarray(details), frames)

    return fill


def active_edits(shot: Shot) -> tuple[Edit, ...]:
    """The journal's edits that are switched on, in their order."""
    return Journal(shot.edits_path).replay().active


def _save_edits(shot: Shot, folder: StageFolder, edits: AppliedEdits) -> None:
    from toolkit.editing.moved import n_moved

    record: dict[str, Any] = {"edits": edits.record}
    (folder.path / _RECORD).write_text(json.dumps(record), encoding="utf-8")
    moved = edits.moved()
    folder.save("weights", edits.weights)
    folder.save("moved", moved)
    folder.save("morphs", edits.morphs(np.array(shot.array("bases", "frames"))))
    folder.numbers |= {
        "edits": len(edits.record),
        "edited_frames": n_moved(moved),
        "edits_move_at_most": float(moved.max()),
    }


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
