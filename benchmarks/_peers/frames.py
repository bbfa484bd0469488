"""Comparisons over frames: the whole transfer, the smoothing, the weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from benchmarks._peers.comparison import Comparison, timed
from benchmarks._peers.deformation_transfer import transfer_frames
from benchmarks._quality.shots import make_shot, sample_take, stabilised, true_target
from data.samples import SamplePaths
from toolkit.bases import BasisParameters, gram_matrix, non_negative_weights, select_bases
from toolkit.blocks import map_blocks
from toolkit.mesh import TriangleMesh, connected_components
from toolkit.meshio import read_mesh
from toolkit.quality import motion_error
from toolkit.smoothing import SmoothingFilter, SmoothingParameters, smooth_with_pymeshlab
from toolkit.stages import run_stages

__all__ = ["compare_smoothing", "compare_transfer", "compare_weights"]

Array = NDArray[np.float64]
_BLOCK = 16


def compare_transfer(samples: SamplePaths, name: str, count: int, folder: Path) -> Comparison:
    """All frames onto a target whose true answer is known, registration aside.

    Ours is everything from decomposition to written frames. The peer gets the frames without the head's motion.
    """
    take = sample_take(samples.performer, folder / "take", count, wrinkles=False)
    mesh, truth = take.mesh(), samples.truth(name)
    rest = truth.shape(np.zeros(52))
    shot = make_shot(folder / "shot", take, true_target(samples, name, mesh, folder), samples.performer.feature_lines)
    run_stages(shot, ["register"])
    _, ours_s = timed(lambda: run_stages(shot))
    steady = (take.sequence().read(0, len(take.weights)) - take.motion.translations[:, None]) @ take.motion.rotations
    labels = connected_components(mesh.triangles, mesh.n_vertices)[1]
    moved = np.sqrt(((steady - mesh.vertices) ** 2).sum(axis=2)).max(axis=0)
    order = np.lexsort((moved, labels))
    anchors = order[np.unique(labels[order], return_index=True)[1]]
    theirs, peer_s = timed(lambda: list(transfer_frames(mesh.vertices, steady, rest, mesh.triangles, anchors)))
    answers = [truth.shape(weights) for weights in take.weights]
    errors = [100 * motion_error(frames, answers, rest).relative for frames in (stabilised(shot, take), theirs)]
    size = f"{mesh.n_vertices:,} x {len(answers)}"
    return Comparison("deformation_transfer", size, ours_s, peer_s, errors[0], errors[1], "error over motion, %")


def compare_smoothing(samples: SamplePaths, count: int, judged: int = 2) -> Comparison:
    """40 steps of Taubin's filter; off is the largest distance from MeshLab's own filter, borders included."""
    import trimesh

    mesh = read_mesh(samples.performer.reference)
    frames = _spread(samples, count)
    parameters = SmoothingParameters()
    filter_ = SmoothingFilter(mesh.triangles, mesh.n_vertices, parameters)
    filter_.smooth(frames[0].astype(np.float32))  # compiled
    out = np.empty(frames.shape, dtype=np.float32)

    def ours() -> None:
        def work(start: int, stop: int) -> None:
            deltas = (frames[start:stop] - mesh.vertices).astype(np.float32)
            columns = np.ascontiguousarray(deltas.transpose(1, 2, 0)).reshape(mesh.n_vertices, -1)
            smoothed = filter_.smooth(columns).reshape(mesh.n_vertices, 3, -1)
            out[start:stop] = smoothed.transpose(2, 0, 1) + rest

        # The filter is linear, and small displacements lose less in single precision.
        rest = filter_.smooth(mesh.vertices)
        map_blocks(work, count, _BLOCK, what="smoothing")

    def theirs() -> list[NDArray]:
        shape = trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
        operator = trimesh.smoothing.laplacian_calculation(shape)
        results = []
        for frame in frames:
            shape.vertices = frame
            trimesh.smoothing.filter_taubin(shape, parameters.lambda_, -parameters.mu, 2 * parameters.steps, operator)
            results.append(np.array(shape.vertices))
        return results

    _, ours_s = timed(ours)
    results, peer_s = timed(theirs)
    off = [0.0, 0.0]
    for t in np.linspace(0, count - 1, judged).astype(int):
        meshlab = smooth_with_pymeshlab(TriangleMesh(frames[t].astype(np.float64), mesh.triangles), parameters)
        for k, found in enumerate((out[t], results[t])):
            off[k] = max(off[k], float(np.linalg.norm(found - meshlab, axis=1).max()))
    return Comparison(
        "filter_taubin", f"{mesh.n_vertices:,} x {count}", ours_s, peer_s, off[0], off[1], "largest distance, cm"
    )


def compare_weights(samples: SamplePaths, count: int, n_bases: int) -> Comparison:
    """Non-negative weights of all frames on the same bases; off is the residual's RMS over vertices and frames."""
    mesh = read_mesh(samples.performer.reference)
    deltas = (_spread(samples, count) - mesh.vertices).astype(np.float32)
    chosen = select_bases(gram_matrix(deltas), mesh.n_vertices, BasisParameters(threshold=0, count=n_bases)).frames
    flat = deltas.reshape(count, -1)

    def ours() -> Array:
        coupling = gram_matrix(deltas)[:, chosen]
        return non_negative_weights(coupling[chosen], coupling)

    def theirs() -> Array:
        bases = flat[chosen].astype(np.float64).T
        return np.stack([scipy.optimize.nnls(bases, frame.astype(np.float64))[0] for frame in flat])

    ours()
    (found, ours_s), (peers, peer_s) = timed(ours), timed(theirs)
    rms = [_residual(flat, chosen, weights) / np.sqrt(mesh.n_vertices) for weights in (found, peers)]
    size = f"{mesh.n_vertices:,} x {count} x {len(chosen)}"
    return Comparison("nnls", size, ours_s, peer_s, rms[0], rms[1], "RMS residual, cm")


def _residual(flat: NDArray, chosen: NDArray, weights: Array) -> float:
    bases = flat[chosen].astype(np.float64)
    squared = [float(np.sum((frame - row @ bases) ** 2)) for frame, row in zip(flat, weights, strict=True)]
    return float(np.sqrt(np.mean(squared)))


def _spread(samples: SamplePaths, count: int) -> NDArray[np.float64]:
    """Evenly spaced frames of the performance without the head's motion, ``(count, V, 3)``."""
    frames = np.load(samples.performer.frames, mmap_mode="r")
    chosen = np.linspace(0, len(frames) - 1, count).round().astype(int)
    with np.load(samples.performer.head_motion) as held:
        rotations, translations = held["rotations"][chosen], held["translations"][chosen]
    return np.asarray((frames[chosen] - translations[:, None]) @ rotations)
