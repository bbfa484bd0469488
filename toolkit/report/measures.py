"""What can be measured on any result: do lids and lips close, does it tremble, how wrinkled is it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from toolkit.contacts import ContactPairs
from toolkit.meshio.sequence import frame_blocks

__all__ = ["contact_gaps", "detail_energy", "jitter"]

Array = NDArray[np.float64]
Read = Callable[[int, int], NDArray[np.floating]]
"""``read(start, stop)`` returns frames as ``(stop - start, V, 3)``."""

_SAMPLE = 2000


def contact_gaps(read: Read, n_frames: int, rest: Array, pairs: ContactPairs, names: Sequence[str]) -> dict[str, Array]:
    """Mean gap of each opening in every frame ``(T,)``, in percent of its corner-to-corner width at rest.

    ``rest`` (V, 3), ``names`` of the openings in the order of their pairs.
    """
    if not len(pairs):
        return {}
    share = np.empty((n_frames, len(pairs)))
    widths = np.maximum(pairs.widths(rest), 1e-30)
    for start, stop in frame_blocks(n_frames, len(rest)):
        share[start:stop] = np.linalg.norm(pairs.gaps(read(start, stop)), axis=2) / widths
    _, first, opening = np.unique(pairs.corners, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    labels = [*names, *(f"opening {k + 1}" for k in range(len(names), len(order)))]
    return {
        label: 100 * share[:, opening.ravel() == group].mean(axis=1)
        for label, group in zip(labels, order, strict=False)
    }


def jitter(read: Read, n_frames: int, n_vertices: int) -> float:
    """RMS length of the second differences in time, over an even choice of vertices, in the mesh's unit a frame^2."""
    if n_frames < 3:
        return 0.0
    ids = np.unique(np.linspace(0, n_vertices - 1, min(_SAMPLE, n_vertices)).astype(int))
    points = np.empty((n_frames, len(ids), 3))
    for start, stop in frame_blocks(n_frames, n_vertices):
        points[start:stop] = read(start, stop)[:, ids]
    return float(np.sqrt(np.mean(np.sum(np.diff(points, n=2, axis=0) ** 2, axis=2))))


def detail_energy(details: NDArray[np.floating], gain: Array | None = None) -> Array:
    """RMS length ``(T,)`` of details (T, V, 3), each vertex times its ``gain`` (V,); may be memory-mapped."""
    factor = 1.0 if gain is None else gain**2
    return np.array([np.sqrt(np.mean(factor * np.einsum("vi,vi->v", f, f, dtype=np.float64))) for f in details])
