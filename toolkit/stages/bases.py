"""Stage "bases": contact pairs, and the frames that become bases, with everyone's weights."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from toolkit.bases import gram_matrix, select_bases
from toolkit.contacts import ContactPairs, find_contacts
from toolkit.feature_lines import Opening, find_openings
from toolkit.meshio import FrameSequence
from toolkit.progress import Progress
from toolkit.shot import Shot, StageFolder
from toolkit.stabilisation import HeadMotion
from toolkit.stages.decompose import load_motion
from toolkit.stages.inputs import load_lines, load_mesh, load_sequence

__all__ = ["load_pairs", "work"]

# Most frames in which pairs are looked for.
_PAIRING_FRAMES = 240


def work(shot: Shot, folder: StageFolder, progress: Progress) -> None:
    """Find the contacts, choose bases, fit weights."""
    source = load_mesh(shot, "source")
    openings = find_openings(load_lines(shot), source.vertices)
    with ThreadPoolExecutor(1) as pool:  # beside the Gram matrix, whose threads wait for the memory now and then
        found = pool.submit(_contacts, openings, source.vertices, load_sequence(shot), load_motion(shot))
        gram = gram_matrix(shot.array("decompose", "smooth_deltas"), progress)
    pairs, gaps = found.result()
    chosen = select_bases(gram, source.n_vertices, shot.config.bases, gaps[1:] - gaps[0], progress)
    for name, array in {
        "frames": chosen.frames,
        "weights": chosen.weights,
        "errors": chosen.errors,
        "frame_errors": chosen.frame_errors,
        "pair_vertex": pairs.vertex,
        "pair_edge": pairs.edge,
        "pair_share": pairs.share,
        "pair_closes": pairs.closes,
        "pair_corners": pairs.corners,
        "pair_gaps": gaps,
    }.items():
        folder.save(name, array)
    folder.numbers |= {
        "bases": len(chosen.frames),
        "frames_chosen": chosen.frames.tolist(),
        "motion_rms": float(chosen.errors[0]),
        "error_rms": float(chosen.errors[-1]),
        "error_share": float(chosen.errors[-1] / max(chosen.errors[0], 1e-300)),
        "openings": [opening.name for opening in openings],
        "contact_pairs": len(pairs),
    }


def load_pairs(shot: Shot) -> ContactPairs:
    """The contact pairs of lids and lips."""
    names = ("pair_vertex", "pair_edge", "pair_share", "pair_closes", "pair_corners")
    return ContactPairs(*(np.array(shot.array("bases", name)) for name in names))


def _contacts(
    openings: list[Opening], rest: np.ndarray, sequence: FrameSequence, motion: HeadMotion
) -> tuple[ContactPairs, np.ndarray]:
    """Pairs, and their gaps ``(1 + T, P, 3)`` at rest and in every stabilised frame.

    Only the rims' vertices are read; pairs are found in their numbering and given the mesh's back.
    """
    ids = np.unique(np.concatenate([np.zeros(0, dtype=np.int64)] + [np.r_[o.upper, o.lower] for o in openings]))
    points = np.empty((sequence.n_frames, len(ids), 3))
    for start, stop in sequence.blocks():
        points[start:stop] = sequence.read(start, stop, ids)
    points = (points - motion.translations[:, None]) @ motion.rotations
    compact = [Opening(o.name, np.searchsorted(ids, o.upper), np.searchsorted(ids, o.lower)) for o in openings]
    step = -(-sequence.n_frames // _PAIRING_FRAMES)
    pairs = find_contacts(compact, rest[ids], points[::step])
    gaps = pairs.gaps(np.concatenate([rest[ids][None], points]))
    return ContactPairs(ids[pairs.vertex], ids[pairs.edge], pairs.share, pairs.closes, ids[pairs.corners]), gaps
