"""Taubin's filter for sequences: one linear operator ``M`` for all frames, applied to blocks of them.

One step is ``x += lambda (W - I) x`` followed by ``x += mu (W - I) x`` [Taubin 1995]. ``n`` steps are a polynomial
of degree 2n in ``W``; a Chebyshev expansion of a third of that degree is the same filter to rounding, since the
polynomial is smooth. pymeshlab does single meshes (`smooth_with_pymeshlab`); a test holds the two together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.sparse.csgraph import reverse_cuthill_mckee

from toolkit.blocks import scratch
from toolkit.errors import InputError
from toolkit.kernels import chebyshev_of_average
from toolkit.mesh.core import TriangleMesh
from toolkit.mesh.topology import boundary_edges, edge_counts, unique_edges
from toolkit.operators import smoothing_average
from toolkit.remembered import remembered

__all__ = [
    "SmoothingFilter",
    "SmoothingParameters",
    "apply_steps",
    "parameters_for_wavelength",
    "smooth_with_pymeshlab",
    "smoothing_filter",
]

# Where the pass band ends, as a share of the eigenvalue that 40 steps of (0.5, -0.53) halve.
_PASS_BAND_SHARE = (1 / 0.5 - 1 / 0.53) / 0.317
# Share of what is smoothed that single precision may be off: of a face's motion, some nanometres.
_SINGLE = 2e-6
# What passes that go over a block together may need at once: more of it leaves the cache.
_CACHE_BYTES = 6 * 2**20


@dataclass(frozen=True)
class SmoothingParameters:
    """Strength of the filter; the defaults are the paper's and MeshLab's.

    ``steps`` lambda-mu pairs. ``wavelength``, if given, is the length (mesh units) of the wrinkle that loses half its
    height, and takes the place of ``steps``: 40 steps mean another length at another resolution.
    """

    steps: int = 40
    lambda_: float = 0.5
    mu: float = -0.53
    wavelength: float | None = None

    def __post_init__(self) -> None:
        if self.steps < 0 or not 0 < self.lambda_ < 1 or not -1 <= self.mu < -self.lambda_:
            raise InputError(
                f"smoothing with steps = {self.steps}, lambda = {self.lambda_}, mu = {self.mu} does not smooth",
                remedy="take steps >= 0, 0 < lambda < 1 and mu a little below -lambda, e.g. 0.5 and -0.53",
            )

    def resolved(self, mesh: TriangleMesh) -> SmoothingParameters:
        """The same filter as steps on this mesh: itself, or what ``wavelength`` asks for."""
        if self.wavelength is None:
            return self
        if self.wavelength > mesh.diagonal:
            raise InputError(
                f"the smoothing wavelength {self.wavelength:g} is longer than the face ({mesh.diagonal:.4g})",
                remedy="choose one a little longer than the wrinkles, in the unit of the source",
            )
        ends = mesh.vertices[unique_edges(mesh.triangles)]
        edge = float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))
        return parameters_for_wavelength(self.wavelength, edge, self.lambda_)


def parameters_for_wavelength(wavelength: float, edge: float, lambda_: float = 0.5) -> SmoothingParameters:
    """The filter after which a wave of this length, on a regular mesh with this edge length, has half its height.

    On a regular triangle mesh ``I - W`` has the eigenvalue ``k = 1 - (cos a + 2 cos(a / 2)) / 3`` for a wave along
    an edge, ``a = 2 pi edge / wavelength``, and one step multiplies by ``(1 - lambda k)(1 - mu k)``. The pass band
    ends at ``1/lambda + 1/mu``; it moves with the wavelength, in the proportion that the paper's 40 steps of
    (0.5, -0.53) have: with a fixed mu no number of steps would remove a wave longer than nine edges.
    """
    if wavelength <= 2 * edge:
        raise InputError(
            f"the smoothing wavelength {wavelength:g} is not longer than two edges ({edge:g} each)",
            remedy="choose a longer wavelength",
        )
    turn = 2 * math.pi * edge / wavelength
    half = 1 - (math.cos(turn) + 2 * math.cos(turn / 2)) / 3
    mu = 1 / (half * _PASS_BAND_SHARE - 1 / lambda_)
    response = (1 - lambda_ * half) * (1 - mu * half)
    steps = 1 if response <= 0 else max(1, round(math.log(0.5) / math.log(response)))
    return SmoothingParameters(steps=steps, lambda_=lambda_, mu=mu)


class SmoothingFilter:
    """The operator ``M`` on one connectivity, ready for blocks of frames.

    ``order`` (V,) is the renumbering (reverse Cuthill-McKee) in which blocks are kept: row i of a block is vertex
    ``order[i]``, vertex v is in row ``position[v]``. `smooth` takes any array ``(V, C)`` in the original numbering,
    `smooth_block` one in the new.
    """

    def __init__(
        self,
        triangles: NDArray[np.integer],
        n_vertices: int,
        parameters: SmoothingParameters,
    ) -> None:
        average = smoothing_average(triangles, n_vertices)
        self.order = np.ascontiguousarray(reverse_cuthill_mckee(average, symmetric_mode=False), dtype=np.int64)
        self.position = np.empty(n_vertices, dtype=np.int64)
        self.position[self.order] = np.arange(n_vertices)
        renumbered = average[self.order][:, self.order].tocsr()
        renumbered.sort_indices()
        # Unsigned, since a compiled loop asks of every signed index whether it counts from the end.
        self._starts, self._neighbours = renumbered.indptr.astype(np.uint32), renumbered.indices.astype(np.uint32)
        count = np.diff(renumbered.indptr)
        self._largest = largest_eigenvalue(triangles)
        half = self._largest / 2
        # S = (I - W) / half - I; W is a mean: the entries of a row are all alike.
        self._own, self._shares = 1 / half - 1, np.array([[1.0], [2.0]]) / (half * count)
        self._bounds = level_bounds(renumbered)
        self.coefficients = filter_coefficients(parameters.steps, parameters.lambda_, parameters.mu, self._largest)
        tail = np.cumsum(np.abs(self.coefficients[::-1]))[::-1]
        self._coefficients32 = self.coefficients[: max(1, int(np.count_nonzero(tail > _SINGLE)))]

    def smooth(self, values: NDArray[np.floating]) -> NDArray[np.floating]:
        """``M values`` for an array ``(V, C)`` in the original numbering, in the precision that it has."""
        result = np.empty_like(values)
        result[self.order] = self.smooth_block(np.ascontiguousarray(values[self.order]))
        return result

    def average(self, values: NDArray[np.float64], passes: int) -> NDArray[np.float64]:
        """``((I + W) / 2)^passes values`` for an array ``(V, C)`` in the original numbering; ``W`` is a mean.

        A polynomial, too, of a degree that grows with the root of the passes only.
        """
        block = np.ascontiguousarray(values[self.order])
        result = np.empty_like(block)
        result[self.order] = self._polynomial(filter_coefficients(passes, 0.5, 0.0, self._largest), block)
        return result

    def smooth_block(
        self, block: NDArray[np.floating], out: NDArray[np.floating] | None = None
    ) -> NDArray[np.floating]:
        """``M block`` for a contiguous block ``(V, ...)`` in the renumbered order, in ``out`` if that is given.

        The block is left alone. Rounding is that of its type: give small deltas, not positions, where float32 is used.
        """
        coefficients = self._coefficients32 if block.dtype == np.float32 else self.coefficients
        return self._polynomial(coefficients, block, out)

    def _polynomial(
        self, coefficients: NDArray[np.float64], block: NDArray[np.floating], out: NDArray[np.floating] | None = None
    ) -> NDArray[np.floating]:
        """The polynomial with these Chebyshev coefficients, of ``W``, applied to a block."""
        smooth = np.empty_like(block) if out is None else out
        flat = block.reshape(len(block), -1)
        # Three arrays, of which a step needs about a chunk.
        chunk_bytes = 3 * flat.nbytes / max(len(self._bounds) - 1, 1)
        chebyshev_of_average(
            self._starts,
            self._neighbours,
            self._shares.astype(block.dtype),
            block.dtype.type(self._own),
            coefficients.astype(block.dtype),
            self._bounds,
            max(1, int(_CACHE_BYTES / max(chunk_bytes, 1))),
            flat,
            smooth.reshape(flat.shape),
            scratch("smoothing", flat.shape, flat.dtype),
        )
        return smooth


@remembered
def smoothing_filter(
    triangles: NDArray[np.integer], n_vertices: int, parameters: SmoothingParameters
) -> SmoothingFilter:
    """The filter on this connectivity, kept: source and target share it."""
    return SmoothingFilter(triangles, n_vertices, parameters)


def level_bounds(graph: sp.csr_matrix) -> NDArray[np.int64]:
    """Bounds (N + 1,) between chunks of a graph's rows that have neighbours in the chunks beside them only.

    In the order of a breadth-first search these are its levels.
    """
    n = graph.shape[0]
    rows = np.repeat(np.arange(n), np.diff(graph.indptr))
    # The last row that any row up to this one has to do with, whichever of the two sees the other: a border row is seen
    # by rows inside that it does not see.
    furthest = np.arange(n)
    np.maximum.at(furthest, np.minimum(rows, graph.indices), np.maximum(rows, graph.indices))
    furthest = np.maximum.accumulate(furthest)
    bounds = [0, min(1, n)]
    while bounds[-1] < n:
        bounds.append(max(bounds[-1], int(furthest[bounds[-1] - 1])) + 1)
    return np.array(bounds)


def largest_eigenvalue(triangles: NDArray[np.integer]) -> float:
    """A bound on the eigenvalues of ``I - W``, ``W`` the `smoothing_average`: 3/2 on a surface, 2 on any mesh.

    The adjacency is half the sum of the triangles' own, each of which is at least ``-I`` on its corners. A vertex off
    the border has as many triangles as neighbours, so ``A >= -D / 2`` there and ``W = D^-1 A >= -1/2``. Border vertices
    see the border alone, each the mean of itself and two others: ``W >= -1/3``. Where edges have three triangles or
    borders touch, this does not hold.
    """
    border = np.bincount(boundary_edges(triangles).ravel(), minlength=1)
    return 1.5 if edge_counts(triangles).max(initial=0) <= 2 and border.max() <= 2 else 2.0


def filter_coefficients(steps: int, lambda_: float, mu: float, largest: float = 2.0) -> NDArray[np.float64]:
    """Chebyshev coefficients of ``((1 - lambda k)(1 - mu k))^steps`` in ``s = 2 k / largest - 1`` on [-1, 1].

    ``k`` in [0, ``largest``] are the eigenvalues of ``I - W``. Cut where the rest is below 1e-11; nodes are
    doubled until that is so, since thousands of steps are still a polynomial of a few hundred degrees.
    """
    n_nodes = 32
    while True:
        angles = np.pi * (np.arange(n_nodes) + 0.5) / n_nodes
        k = (np.cos(angles) + 1) * largest / 2
        full = dct(((1 - lambda_ * k) * (1 - mu * k)) ** steps, type=2) / n_nodes
        full[0] /= 2
        tail = np.cumsum(np.abs(full[::-1]))[::-1]
        degree = int(np.count_nonzero(tail > 1e-11))
        # The last quarter must be rounding only, or higher terms are folded into lower ones.
        if degree < 0.75 * n_nodes:
            return full[: max(1, degree)]
        if n_nodes >= _MOST_NODES:
            raise InputError(
                f"{steps} smoothing steps with lambda = {lambda_} and mu = {mu} amplify what they should keep",
                remedy="ask for a shorter wavelength or fewer steps in [smoothing]",
            )
        n_nodes *= 2


_MOST_NODES = 2**16
"""Rounding grows with the nodes: where this many do not settle a filter, no number of them does."""


def apply_steps(
    average: sp.csr_matrix, values: NDArray[np.float64], steps: int, lambda_: float, mu: float
) -> NDArray[np.float64]:
    """The filter as it is written, pass after pass: slow, and the oracle of `SmoothingFilter`."""
    for _ in range(steps):
        for weight in (lambda_, mu):
            values = values + weight * (average @ values - values)
    return values


def smooth_with_pymeshlab(mesh: TriangleMesh, parameters: SmoothingParameters) -> NDArray[np.float64]:
    """Smoothed vertices ``(V, 3)`` of one mesh by MeshLab's own filter (0.3 s at 80K vertices)."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.triangles))
    steps = parameters.resolved(mesh)
    meshes.apply_coord_taubin_smoothing(lambda_=steps.lambda_, mu=steps.mu, stepsmoothnum=steps.steps)
    # Copied before the MeshSet goes: afterwards the array would be silently empty.
    return np.array(meshes.current_mesh().vertex_matrix(), dtype=np.float64)
