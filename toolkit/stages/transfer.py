"""Stage "transfer": the bases on the target, by deformation gradients, feature lines and contacts."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from toolkit.contacts import ContactMap
from toolkit.decomposition import Decomposer
from toolkit.details import detail_gain
from toolkit.feature_lines import line_edges
from toolkit.large_scale import transfer_bases
from toolkit.mesh import TriangleMesh
from toolkit.progress import Progress
from toolkit.remembered import remembered
from toolkit.shot import Shot, StageFolder
from toolkit.smoothing import SmoothingParameters
from toolkit.solve import Factor, factorise
from toolkit.stages.bases import load_pairs
from toolkit.stages.inputs import load_lines, load_mesh
from toolkit.stages.register import load_target
from toolkit.transfer import DeformationTransfer

__all__ = ["SavedSystem", "open_system", "target_decomposer", "work"]

_MATRIX = ("data", "indices", "indptr")


def work(shot: Shot, folder: StageFolder, progress: Progress) -> None:
    """Factorise once, solve for all bases."""
    target = target_decomposer(shot)
    frames = np.array(shot.array("bases", "frames"))
    moves = shot.array("decompose", "smooth_deltas")[frames]
    source = np.array(shot.array("decompose", "rest_smooth"))
    progress("factorising", 0, 1)
    with ThreadPoolExecutor(1) as pool:  # neither needs the other, and both leave a processor idle
        gained = pool.submit(detail_gain, shot.config.details, source, target)
        system = _system(shot, source, target, moves)
    gain = gained.result()
    progress("factorising", 1, 1)
    details = shot.array("decompose", "details")[np.ix_(frames, system.pairs.vertices)]
    gaps = np.array(shot.array("bases", "pair_gaps"))[1:][frames]
    contact_map = ContactMap(load_pairs(shot), load_mesh(shot, "source").vertices, target.mesh.vertices)
    bases = transfer_bases(system, target, moves, details, gain, contact_map, gaps, progress)
    folder.save("bases", bases)
    folder.save("rest", target.rest.smooth)
    folder.save("gain", gain)
    for name in _MATRIX:
        folder.save(f"matrix_{name}", getattr(system.matrix, name))
    folder.numbers |= {
        "bases": len(bases),
        "feature_line_edges": len(line_edges(load_lines(shot))) if shot.config.transfer.feature_lines else 0,
        "contact_pairs": len(system.pairs),
    }


@dataclass(frozen=True, eq=False)
class SavedSystem:
    """The matrix that the finished stage solved with, and its factor once that is needed."""

    matrix: sp.csc_matrix

    @cached_property
    def factor(self) -> Factor:
        """Made anew: the solver's library has no way to keep one."""
        return factorise(self.matrix)


def open_system(shot: Shot) -> SavedSystem:
    """The system that the finished stage solved: what edits of poses need."""
    data, indices, starts = (np.array(shot.array("transfer", f"matrix_{name}")) for name in _MATRIX)
    n = len(starts) - 1
    return SavedSystem(sp.csc_matrix((data, indices, starts), shape=(n, n)))


def target_decomposer(shot: Shot) -> Decomposer:
    """The target's smoothing and local frames, with the source's strength and frame neighbours."""
    strength = shot.config.smoothing.resolved(load_mesh(shot, "source"))
    return _decomposed(load_target(shot), strength, np.array(shot.array("decompose", "neighbour")))


@remembered
def _decomposed(mesh: TriangleMesh, parameters: SmoothingParameters, neighbour: np.ndarray) -> Decomposer:
    """Kept, since the stage "result" and the edits begin with it, too."""
    return Decomposer(mesh, parameters, neighbour)


def _system(shot: Shot, source: np.ndarray, target: Decomposer, moves: np.ndarray) -> DeformationTransfer:
    return DeformationTransfer(
        source,
        target.rest.smooth,
        target.mesh.triangles,
        moves,
        line_edges(load_lines(shot)),
        load_pairs(shot),
        shot.config.transfer,
    )
