"""Stage "transfer": the bases on the target, by deformation gradients, feature lines and contacts."""

from __future__ import annotations

import numpy as np

from toolkit.contacts import ContactMap
from toolkit.decomposition import Decomposer
from toolkit.details import detail_gain
from toolkit.feature_lines import line_edges
from toolkit.large_scale import transfer_bases
from toolkit.progress import Progress
from toolkit.shot import Shot, StageFolder
from toolkit.stages.bases import load_pairs
from toolkit.stages.inputs import load_lines, load_mesh
from toolkit.stages.register import load_target
from toolkit.transfer import DeformationTransfer, triangle_weights

__all__ = ["target_decomposer", "work"]


def work(shot: Shot, folder: StageFolder, progress: Progress) -> None:
    """Factorise once, solve for all bases."""
    source = load_mesh(shot, "source")
    smooth = np.array(shot.array("decompose", "rest_smooth"))
    target = target_decomposer(shot)
    pairs = load_pairs(shot)
    frames = np.array(shot.array("bases", "frames"))
    deltas, details = shot.array("decompose", "smooth_deltas"), shot.array("decompose", "details")
    shapes = smooth + deltas[frames]
    motion = _motion(deltas)
    weights = triangle_weights(smooth, shapes, source.triangles) if shot.config.transfer.robust else None
    progress("factorising", 0, 1)
    system = DeformationTransfer(
        smooth,
        target.rest.smooth,
        source.triangles,
        motion,
        line_edges(load_lines(shot)),
        pairs,
        shot.config.transfer,
        weights,
    )
    progress("factorising", 1, 1)
    gain = detail_gain(shot.config.details, smooth, target.rest.smooth, source.triangles)
    gaps = np.array(shot.array("bases", "pair_gaps"))[1:][frames]
    contact_map = ContactMap(pairs, source.vertices, target.mesh.vertices)
    bases = transfer_bases(system, target, shapes, details[frames], gain, pairs, contact_map, gaps, progress)
    folder.save("bases", bases)
    folder.save("rest", target.rest.smooth)
    folder.save("gain", gain)
    folder.save("motion", motion)
    folder.numbers |= {
        "bases": len(bases),
        "feature_line_edges": len(line_edges(load_lines(shot))) if shot.config.transfer.feature_lines else 0,
        "contact_pairs": len(pairs) if shot.config.transfer.contacts else 0,
    }


def target_decomposer(shot: Shot) -> Decomposer:
    """The target's smoothing and local frames, with the source's strength and frame neighbours."""
    strength = shot.config.smoothing.resolved(load_mesh(shot, "source"))
    return Decomposer(load_target(shot), strength, np.array(shot.array("decompose", "neighbour")))


def _motion(deltas: np.ndarray) -> np.ndarray:
    """How far each vertex moves at most over the take, ``(V,)``."""
    farthest = np.zeros(deltas.shape[1])
    for frame in deltas:
        np.maximum(farthest, np.einsum("vi,vi->v", frame, frame), out=farthest)
    return np.sqrt(farthest)
