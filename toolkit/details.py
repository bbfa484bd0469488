"""Fine-scale transfer and reconstruction of every frame (the paper's section 5.1, Eqs. 5 and 16; method, section 7).

``T_t = T~_t + G_t (e_0' + g s d_t)``: ``T~_t = T~_0 + sum_i w_ti (b'_i - T~_0)`` the large-scale shape, ``G_t`` its
local frames, ``e_0'`` the target's own detail, ``d_t`` the source's motion detail, ``s`` the local size ratio of the
faces and ``g`` the user's gain. No solve: a frame is a product, local frames and a rotation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import block_size, map_blocks
from toolkit.coating_details import CoatingDetails
from toolkit.decomposition import Decomposer
from toolkit.errors import InputError
from toolkit.kernels import add_head_motion, block_to_frames, frames_to_block, rotate_details
from toolkit.mesh.geometry import vertex_areas
from toolkit.operators import neighbour_average
from toolkit.progress import Progress, silent
from toolkit.rigid import Similarity
from toolkit.stabilisation import HeadMotion

__all__ = ["DetailParameters", "Reconstruction", "detail_gain", "local_size_ratio", "reconstruct_sequence"]

Array = NDArray[np.float64]

_METHODS = ("displacement", "coating")
_SCALES = ("local", "global")
_RATIO_SMOOTHING = 60


@dataclass(frozen=True)
class DetailParameters:
    """How details are carried over.

    ``gain`` scales the source's motion details (the paper weakens them for a baby's face; 0 leaves the target's own).
    ``method`` "displacement" (default), or "coating", the paper's own, screened by ``screening`` (in units of the
    Laplacian's eigenvalues, 0 to 2; at least 0.1). ``scale`` "local" follows the local size ratio of the faces, so that
    wrinkles keep their slope; "global" takes one ratio for the whole face.
    """

    gain: float = 1.0
    method: str = "displacement"
    screening: float = 0.3
    scale: str = "local"

    def __post_init__(self) -> None:
        if self.method not in _METHODS or self.scale not in _SCALES:
            raise InputError(
                f"details with method = {self.method!r} and scale = {self.scale!r} are unknown",
                remedy=f"method is one of {_METHODS}, scale one of {_SCALES}",
            )
        if not np.isfinite(self.gain) or (self.method == "coating" and not self.screening > 0):
            raise InputError(
                f"details with gain = {self.gain} and screening = {self.screening} make no sense",
                remedy="give a finite gain and a positive screening",
            )


class Reconstruction:
    """Everything that turns weights and motion details into frames of the target; any frame on demand.

    Parameters
    ----------
    target : the decomposed target reference, in the source's pose and size, on the source's topology and neighbours
    bases : (K, V, 3) transferred bases b', in the same pose
    weights : (T, K)
    gain : (V,) factor of the motion details, size ratio included
    motion : the head's motion, applied in the source's pose and size
    pose : the similarity from there to the target's own place
    coating : the paper's reconstruction instead of the rotation, if given
    """

    def __init__(
        self,
        target: Decomposer,
        bases: Array,
        weights: Array,
        gain: NDArray[np.floating],
        motion: HeadMotion,
        pose: Similarity,
        coating: CoatingDetails | None = None,
    ) -> None:
        order = target.filter.order
        self._target, self._order, self._coating = target, order, coating
        self._weights = np.asarray(weights, dtype=np.float32)
        smooth = target.rest.smooth
        self._origin = smooth.mean(axis=0)
        self._rest = (smooth - self._origin)[order].astype(np.float32)
        moves = (bases - smooth)[:, order]  # (K, V, 3)
        self._moves = np.ascontiguousarray(moves.reshape(len(bases), -1).T, dtype=np.float32)
        self._detail = target.rest.detail[order].astype(np.float32)
        self._gain = np.asarray(gain)[order].astype(np.float32)
        self._rotations, self._translations = _placed(motion, pose, self._origin)
        self._scale = pose.scale

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self._weights)

    def frames(self, start: int, stop: int, details: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        """Write frames ``start <= t < stop`` to ``out`` (B, V, 3), from the source's motion details (B, V, 3)."""
        n_vertices, size = len(self._order), stop - start
        combined = self._moves @ self._weights[start:stop].T
        points = combined.reshape(n_vertices, 3, size) + self._rest[:, :, None]
        shift = np.empty((n_vertices, 3, size), dtype=np.float32)
        frames_to_block(details, self._order, *_no_motion(size), np.zeros((n_vertices, 3)), shift)
        block = self._target.block
        scratch = np.empty_like(points)
        rotate_details(points, block.triangles, block.neighbour, scratch, shift, self._gain, self._detail, shift)
        if self._coating is not None:
            shift = self._coating.displacement(points, shift, start, stop)
        points += shift
        add_head_motion(points, self._rotations[start:stop], self._translations[start:stop], self._scale)
        block_to_frames(points, self._order, out)


def reconstruct_sequence(
    reconstruction: Reconstruction,
    details: NDArray[np.float32],
    out: NDArray[np.float32],
    progress: Progress = silent,
) -> None:
    """Write every frame to ``out`` (T, V, 3), possibly memory-mapped, from motion details (T, V, 3)."""

    def work(start: int, stop: int) -> None:
        reconstruction.frames(start, stop, np.ascontiguousarray(details[start:stop]), out[start:stop])

    map_blocks(work, len(out), block_size(out.shape[1]), what="building frames", progress=progress)


def local_size_ratio(source: Array, target: Array, triangles: NDArray[np.integer]) -> Array:
    """``s`` (V,): the target's length over the source's at each vertex, from smoothed areas, between 1/3 and 3.

    Wrinkles scaled by it keep their slope. Smoothed far beyond a wrinkle, since the ratio of single triangles is the
    registration's noise.
    """
    average = neighbour_average(triangles, len(source))
    areas = [vertex_areas(x, triangles) for x in (source, target)]
    for _ in range(_RATIO_SMOOTHING):
        areas = [0.5 * (a + average @ a) for a in areas]
    floor = 1e-12 * max(float(areas[0].max()), 1e-300)
    return np.clip(np.sqrt(np.maximum(areas[1], floor) / np.maximum(areas[0], floor)), 1 / 3, 3)


def _placed(motion: HeadMotion, pose: Similarity, origin: Array) -> tuple[Array, Array]:
    """Rotations and translations that take centred, stabilised points to the target's own place, frame by frame."""
    rotations = pose.rotation @ motion.rotations
    moved = motion.rotations @ origin + motion.translations
    return rotations, pose.scale * moved @ pose.rotation.T + pose.translation


def _no_motion(size: int) -> tuple[Array, Array]:
    return np.tile(np.eye(3), (size, 1, 1)), np.zeros((size, 3))


def detail_gain(parameters: DetailParameters, source: Array, target: Array, triangles: NDArray[np.integer]) -> Array:
    """Factor of the motion details for each vertex ``(V,)``: the user's gain times the size ratio.

    Both faces are in the source's pose and size, so the global ratio is 1 here.
    """
    if parameters.scale == "global":
        return np.full(len(source), parameters.gain)
    return parameters.gain * local_size_ratio(source, target, triangles)
