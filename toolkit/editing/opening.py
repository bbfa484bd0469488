"""A shot whose stages up to "transfer" have been run, opened for editing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.decomposition import Decomposer
from toolkit.details import Reconstruction
from toolkit.editing.details import DetailSolver, detail_take
from toolkit.editing.placement import Placement
from toolkit.errors import InputError
from toolkit.pose_edit import EditableTake, TouchingPairs
from toolkit.progress import Progress, silent
from toolkit.shot import Shot
from toolkit.stages import current_key
from toolkit.stages.bases import load_pairs
from toolkit.stages.decompose import load_motion
from toolkit.stages.register import load_pose
from toolkit.stages.result import open_reconstruction
from toolkit.stages.transfer import open_system, target_decomposer

__all__ = ["OpenedTake", "open_take"]

_NEEDED = ("inputs", "register", "decompose", "bases", "transfer")


@dataclass(frozen=True, eq=False)
class OpenedTake:
    """The unedited take of a shot, in the pose of the bases, and what turns it into frames of the result.

    ``target`` the decomposed target, ``details`` (T, V, 3) the source's motion details, memory-mapped, ``gain`` (V,)
    their factor, ``reconstruction`` what builds frames, ``take`` what edits of poses change, ``detail_solver`` what
    solves edits of details.
    """

    target: Decomposer
    details: NDArray[np.float32]
    gain: NDArray[np.float64]
    reconstruction: Reconstruction
    take: EditableTake
    placement: Placement
    detail_solver: DetailSolver
    by_coating: bool


def open_take(shot: Shot, progress: Progress = silent) -> OpenedTake:
    """Load what the stages left."""
    for stage in _NEEDED:
        if not shot.is_current(stage, current_key(shot, stage)):
            raise InputError(
                f'the stage "{stage}" is missing or older than the shot\'s files and parameters',
                where=shot.path,
                remedy=f"run scripts/run_all.py {shot.path}",
            )
    progress("opening the shot", 0, 3)
    target = target_decomposer(shot)
    progress("opening the shot", 1, 3)
    reconstruction = open_reconstruction(shot, target)
    progress("opening the shot", 2, 3)
    bases = np.array(shot.array("transfer", "bases"))
    rest = target.rest.smooth
    weights = np.array(shot.array("bases", "weights"), dtype=np.float64)
    take = EditableTake(rest, bases - rest, weights, open_system(shot), contacts=_contacts(shot))
    progress("opening the shot", 3, 3)
    details = detail_take(shot, target)
    return OpenedTake(
        target,
        details.details,
        details.gain,
        reconstruction,
        take,
        Placement(load_pose(shot), load_motion(shot)),
        DetailSolver(shot, details),
        shot.config.details.method == "coating",
    )


def _contacts(shot: Shot) -> TouchingPairs:
    """Which lids and lips touch when, as on the source."""
    gaps = np.array(shot.array("bases", "pair_gaps"))[1:]
    return TouchingPairs.by_gaps(load_pairs(shot), gaps, np.array(shot.array("inputs", "source_vertices")))
