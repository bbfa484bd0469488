"""Splitting frames into large-scale shape and fine detail (the paper's section 3; method, section 3).

``S_t = S~_t + F_t (e_0 + d_t)``: ``S~_t`` the frame smoothed by Taubin's filter, ``F_t`` the local frames of ``S~_t``,
``e_0`` the reference's own detail and ``d_t`` the motion detail, in place of the paper's Eq. 3. Details are
displacements in local frames: rotated Laplacian coatings are no longer the Laplacian of anything, and solving for them
blows that up. The coating ``xi = L (S - S~)`` remains the measure for colour maps and thresholds, and
`reconstruct_from_coating` is Eq. 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.blocks import scratch
from toolkit.frame_kernels import block_frames, longest_in_plane, opposite_edges, take_details
from toolkit.kernels import add_shape, block_to_frames, frames_to_block
from toolkit.mesh.core import TriangleMesh
from toolkit.mesh.topology import connected_components, vertex_adjacency
from toolkit.meshio.sequence import FrameSequence
from toolkit.operators import uniform_laplacian
from toolkit.smoothing import SmoothingFilter, SmoothingParameters, smoothing_filter
from toolkit.solve import factorise
from toolkit.stabilisation import HeadMotion

__all__ = [
    "Decomposer",
    "RestShape",
    "coating",
    "decompose_block",
    "frame_neighbours",
    "reconstruct_from_coating",
]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RestShape:
    """A reference face, decomposed.

    ``smooth`` (V, 3) the large-scale shape, ``detail`` (V, 3) the fine detail ``e_0`` in the local frames of ``smooth``
    whose tangents point to ``neighbour`` (V,).
    """

    smooth: Array
    detail: Array
    neighbour: NDArray[np.int64]


class Decomposer:
    """Smoothing and local frames on one connectivity, ready for any number of frames.

    ``rest`` is the decomposed reference, ``filter`` the smoothing operator. Blocks are ``(V, 3, B)`` float32 in the
    filter's numbering.
    """

    def __init__(
        self,
        mesh: TriangleMesh,
        parameters: SmoothingParameters | None = None,
        neighbour: NDArray[np.integer] | None = None,
    ) -> None:
        self.mesh = mesh
        resolved = (parameters or SmoothingParameters()).resolved(mesh)
        self.filter = smoothing_filter(mesh.triangles, mesh.n_vertices, resolved)
        smooth = np.asarray(self.filter.smooth(mesh.vertices), dtype=np.float64)
        if neighbour is None:
            neighbour = frame_neighbours(smooth, mesh.triangles)
        self.block = BlockNumbering(self.filter, mesh.triangles, neighbour)
        order = self.filter.order
        ordered, offset = smooth[order], (mesh.vertices - smooth)[order]
        own = np.einsum("vjit,vj->vi", block_frames(ordered[:, :, None], *self.block.stencil), offset)
        detail = np.empty_like(own)
        detail[order] = own
        self.rest = RestShape(smooth, detail, np.asarray(neighbour, dtype=np.int64))
        self._smooth32 = (ordered - smooth.mean(axis=0)).astype(np.float32)
        self._offset32, self._detail32 = offset.astype(np.float32), own.astype(np.float32)

    def decompose(
        self, frames: NDArray[np.float32], motion: HeadMotion, start: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Frames ``(B, V, 3)`` from ``start`` on -> smoothed deltas ``S~_t - S~_0`` and motion details, ``(V, 3, B)``.

        Deltas are small, so float32 costs 1e-7 of the motion, not of the position. Both arrays are this thread's
        scratch: its next block takes their place.
        """
        shape = (self.mesh.n_vertices, 3, len(frames))
        delta, smooth, points, details = (scratch(f"block {k}", shape) for k in range(4))
        rotations, translations = (x[start : start + len(frames)] for x in (motion.rotations, motion.translations))
        # The inverse of a rotation is its transpose.
        turns, shifts = np.ascontiguousarray(rotations.T), np.einsum("bik,bi->kb", rotations, translations)
        frames_to_block(frames, self.filter.position, turns, shifts, self.mesh.vertices, delta)
        self.filter.smooth_block(delta, out=smooth)
        add_shape(smooth, self._smooth32, points)
        take_details(points, *self.block.stencil, smooth, delta, self._offset32, self._detail32, details)
        return smooth, details


class BlockNumbering:
    """Triangles and frame neighbours in the numbering that blocks are kept in.

    ``stencil`` is what compiled loops make local frames from: `opposite_edges` and the neighbours.
    """

    def __init__(
        self, filter_: SmoothingFilter, triangles: NDArray[np.integer], neighbour: NDArray[np.integer]
    ) -> None:
        self.triangles = filter_.position.astype(np.int32)[triangles]
        self.neighbour = filter_.position[np.asarray(neighbour)[filter_.order]]
        self.stencil = (*opposite_edges(self.triangles, len(neighbour)), self.neighbour)


def decompose_block(
    sequence: FrameSequence,
    decomposer: Decomposer,
    motion: HeadMotion,
    start: int,
    stop: int,
    smooth_deltas: NDArray[np.float32],
    details: NDArray[np.float32],
) -> None:
    """Decompose frames ``start <= t < stop`` into ``smooth_deltas`` and ``details``, both ``(B, V, 3)`` float32."""
    smooth, detail = decomposer.decompose(sequence.view(start, stop), motion, start)
    block_to_frames(smooth, decomposer.filter.position, smooth_deltas)
    block_to_frames(detail, decomposer.filter.position, details)


def frame_neighbours(vertices: Array, triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """For each vertex the neighbour that its local frame's tangent points to, ``(V,)``.

    The one whose edge is longest in the tangent plane: the direction then depends least on noise. A vertex without
    neighbours points to itself.
    """
    starts, edges = opposite_edges(np.asarray(triangles), len(vertices))
    return longest_in_plane(np.asarray(vertices, dtype=np.float64), starts, edges)


def coating(vertices: Array, smooth: Array, triangles: NDArray[np.integer]) -> Array:
    """Laplacian coating ``xi = L (S - S~)``, ``(V, 3)`` in mesh units (the paper's Eq. 1; Sorkine et al. 2004)."""
    return np.asarray(uniform_laplacian(triangles, len(vertices)) @ (vertices - smooth))


def reconstruct_from_coating(smooth: Array, xi: Array, triangles: NDArray[np.integer], gauge: Array) -> Array:
    """``S = S~ + L^+ xi`` (the paper's Eq. 2), ``(V, 3)``.

    ``L`` leaves one constant free in each connected component; ``gauge`` (C, 3) is the mean of ``S - S~`` over each
    component in the order of `connected_components`. Only the small detail is solved for, so the round trip is exact.
    """
    n = len(smooth)
    count, labels = connected_components(triangles, n)
    adjacency = vertex_adjacency(triangles, n)
    degree = np.asarray(adjacency.sum(axis=1)).ravel()
    # D L = D - A is symmetric; a rank-one term on each component's first vertex fixes the constant.
    first = np.zeros(n)
    first[np.unique(labels, return_index=True)[1]] = 1
    factor = factorise(sp.csc_matrix(sp.diags(degree + first) - adjacency))
    detail = factor.solve(degree[:, None] * xi)
    size = np.bincount(labels, minlength=count)[:, None]
    mean = np.stack([np.bincount(labels, weights=detail[:, k], minlength=count) for k in range(3)], axis=1) / size
    return smooth + detail + (gauge - mean)[labels]
