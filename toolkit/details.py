"""Fine-scale transfer and reconstruction of every frame (the paper's section 5.1, Eqs. 5 and 16; method, section 7).

``T_t = T~_t + G_t (e_0' + g s d_t)``: ``T~_t = T~_0 + sum_i w_ti (b'_i - T~_0)`` the large-scale shape, ``G_t`` its
local frames, ``e_0'`` the target's own detail, ``d_t`` the source's motion detail, ``s`` the local size ratio of the
faces and ``g`` the user's gain. No solve: a frame is a product, local frames and a rotation.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from toolkit.blocks import scratch
from toolkit.changed_details import ChangedDetails, DetailsChange
from toolkit.coating_details import CoatingDetails
from toolkit.decomposition import Decomposer
from toolkit.errors import InputError
from toolkit.frame_kernels import rotate_details
from toolkit.kernels import block_to_frames, place_block, renumber_frames
from toolkit.mesh.geometry import vertex_areas
from toolkit.rigid import Similarity
from toolkit.stabilisation import HeadMotion

__all__ = [
    "BasesChange",
    "DetailParameters",
    "Reconstruction",
    "detail_gain",
    "local_size_ratio",
]

Array = NDArray[np.float64]

_METHODS = ("displacement", "coating")
_SCALES = ("local", "global")
_RATIO_SMOOTHING = 60
_MOST_KNOWN = 32


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


class BasesChange(Protocol):
    """A pose edit's change of the bases: basis k moves by ``responses (V, U) @ coefficients (U, K, 3)[:, k]``."""

    @property
    def responses(self) -> Array:
        """(V, U)."""

    @property
    def coefficients(self) -> Array:
        """(U, K, 3)."""


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
        origin = smooth.mean(axis=0)
        # The moves to all bases, and the rest shape, whose weight is one.
        self._shapes = np.empty((len(bases) + 1, smooth.size), dtype=np.float32)
        for k, shape in enumerate([*(basis - smooth for basis in bases), smooth - origin]):
            np.take(shape.astype(np.float32), order, axis=0, out=self._shapes[k].reshape(-1, 3), mode="clip")
        self._own = target.rest.detail[order].astype(np.float32)
        self._gain = np.asarray(gain, dtype=np.float32)[order]
        self._turns, self._starts = _placed(motion, pose, origin)
        self._bases_changes: tuple[BasesChange, ...] = ()
        self._changed_details: ChangedDetails | None = None
        # Responses in the blocks' numbering; while an edit is dragged they stay the same from solve to solve.
        self._known: dict[int, tuple[Array, NDArray[np.float32]]] = {}

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self._weights)

    def edited(
        self, weights: Array, bases: Sequence[BasesChange] = (), details: Sequence[DetailsChange] = ()
    ) -> Reconstruction:
        """The same with other weights (T, K) and the changes of all edits; arrays are shared.

        Frames that no change touches come out bit for bit as before.
        """
        other = copy.copy(self)
        other._weights = np.asarray(weights, dtype=np.float32)
        other._bases_changes = tuple(bases)
        other._changed_details = ChangedDetails(self._target, self._gain, details) if details else None
        return other

    def frames(self, start: int, stop: int, details: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        """Write frames ``start <= t < stop`` to ``out`` (B, V, 3), from the source's motion details (B, V, 3)."""
        points = self._large_scale(start, stop)
        shift = self._detail_shift(points, details, start, stop)
        turns, starts = (np.ascontiguousarray(x[..., start:stop]) for x in (self._turns, self._starts))
        placed = scratch("placed", points.shape)
        place_block(points, shift, turns, starts, placed)
        block_to_frames(placed, self._target.filter.position, out)

    def detail_offsets(self, frame: int, details: NDArray[np.float32]) -> NDArray[np.float32]:
        """What details add to the large-scale shape of a frame, before the head's motion, ``(V, 3)``.

        ``details`` (1, V, 3) are the frame's motion details.
        """
        shift = self._detail_shift(self._large_scale(frame, frame + 1), details, frame, frame + 1)
        offsets = np.empty((len(self._order), 3), dtype=np.float32)
        offsets[self._order] = shift[:, :, 0]
        return offsets

    def _large_scale(self, start: int, stop: int) -> NDArray[np.float32]:
        """``T~_t`` about the origin, ``(V, 3, B)``."""
        weights = self._weights[start:stop]
        points = scratch("points", (len(self._order), 3, len(weights)))
        shares = np.vstack([weights.T, np.ones((1, len(weights)), dtype=np.float32)])
        np.matmul(self._shapes.T, shares, out=points.reshape(-1, len(weights)))
        for change in self._bases_changes:
            share = np.einsum("tk,ukc->uct", weights, change.coefficients).astype(np.float32)
            if share.any():
                points += (self._ordered(change) @ share.reshape(len(share), -1)).reshape(points.shape)
        return points

    def _detail_shift(
        self, points: NDArray[np.float32], details: NDArray[np.float32], start: int, stop: int
    ) -> NDArray[np.float32]:
        """What details add to the large-scale ``points``, edits included, ``(V, 3, B)``."""
        shift, block = scratch("shift", points.shape), scratch("details", points.shape)
        renumber_frames(details, self._target.filter.position, block)
        rotate_details(points, *self._target.block.stencil, block, self._gain, self._own, shift)
        if self._coating is not None:
            shift = self._coating.displacement(points, shift, start, stop)
        if self._changed_details is not None:
            # A displacement of its own also here: as a coating it would leak.
            self._changed_details.add(shift, points, details, start, as_seen=self._coating is not None)
        return shift

    def _ordered(self, change: BasesChange) -> NDArray[np.float32]:
        """A change's responses in the blocks' numbering, (V, U)."""
        known = self._known.get(id(change.responses))
        if known is None or known[0] is not change.responses:
            if len(self._known) >= _MOST_KNOWN:
                self._known.clear()
            known = (change.responses, change.responses[self._order].astype(np.float32))
            self._known[id(change.responses)] = known
        return known[1]


def local_size_ratio(source: Array, target: Decomposer) -> Array:
    """``s`` (V,): the target's length over the source's at each vertex, from smoothed areas, between 1/3 and 3.

    ``source`` (V, 3) and the target's large-scale shape are of one size. Wrinkles scaled by ``s`` keep their slope.
    Smoothed far beyond a wrinkle, since the ratio of single triangles is the registration's noise.
    """
    shapes = source, target.rest.smooth
    areas = np.stack([vertex_areas(shape, target.mesh.triangles) for shape in shapes], axis=1)
    areas = target.filter.average(areas, _RATIO_SMOOTHING)
    floor = 1e-12 * max(float(areas[:, 0].max()), 1e-300)
    areas = np.maximum(areas, floor)
    return np.clip(np.sqrt(areas[:, 1] / areas[:, 0]), 1 / 3, 3)


def _placed(motion: HeadMotion, pose: Similarity, origin: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Scaled rotations (3, 3, T) and what is added (3, T): centred, stabilised points to the target's own place."""
    moved = motion.rotations @ origin + motion.translations
    turns = pose.scale * (pose.rotation @ motion.rotations)
    starts = pose.scale * moved @ pose.rotation.T + pose.translation
    return np.moveaxis(turns, 0, 2).astype(np.float32), starts.T.astype(np.float32)


def detail_gain(parameters: DetailParameters, source: Array, target: Decomposer) -> Array:
    """Factor of the motion details for each vertex ``(V,)``: the user's gain times the size ratio.

    Both faces are in the source's pose and size, so the global ratio is 1 here. ``source`` (V, 3) is its large-scale
    shape.
    """
    if parameters.scale == "global":
        return np.full(len(source), parameters.gain)
    return parameters.gain * local_size_ratio(source, target)
