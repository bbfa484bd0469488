"""Details and the surface itself: is the wrinkle there, how wrinkled is it, has anything turned over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.decomposition import coating
from toolkit.mesh.geometry import face_normals

__all__ = ["DetailError", "coating_energy", "detail_energy", "detail_error", "flipped_triangles"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DetailError:
    """How near details are to the true ones.

    ``rms`` and ``largest`` of ``|found - true|`` over all vertices, mesh units; ``correlation`` where the true detail
    exceeds the threshold, 1 for the same up to one factor; ``share`` of the vertices where it does.
    """

    rms: float
    largest: float
    correlation: float
    share: float


def detail_error(found: NDArray[np.floating], true: NDArray[np.floating], threshold: float) -> DetailError:
    """Compare detail displacements ``(..., 3)``, of one frame or of many; ``threshold`` in mesh units.

    The correlation is ``sum found . true / sqrt(sum |found|^2 sum |true|^2)``: details have no mean to take out.
    """
    squared = np.sum((np.asarray(found, dtype=np.float64) - true) ** 2, axis=-1)
    there = np.sum(np.asarray(true, dtype=np.float64) ** 2, axis=-1) > threshold**2
    f, t = np.asarray(found[there], dtype=np.float64), np.asarray(true[there], dtype=np.float64)
    size = np.sqrt(np.sum(f * f) * np.sum(t * t))
    correlation = float(np.sum(f * t) / size) if size > 0 else float("nan")
    return DetailError(
        float(np.sqrt(squared.mean())), float(np.sqrt(squared.max(initial=0))), correlation, float(there.mean())
    )


def coating_energy(vertices: Array, smooth: Array, triangles: NDArray[np.integer]) -> float:
    """RMS magnitude of the coating ``L (S - S~)`` (the paper's Eq. 1) of one frame, in mesh units."""
    return float(np.sqrt(np.mean(np.sum(coating(vertices, smooth, triangles) ** 2, axis=1))))


def detail_energy(details: NDArray[np.floating], gain: Array | None = None) -> Array:
    """RMS length ``(T,)`` of details (T, V, 3), each vertex times its ``gain`` (V,); may be memory-mapped."""
    factor = 1.0 if gain is None else gain**2
    return np.array([np.sqrt(np.mean(factor * np.einsum("vi,vi->v", f, f, dtype=np.float64))) for f in details])


def flipped_triangles(reference: Array, vertices: Array, triangles: NDArray[np.integer]) -> NDArray[np.int64]:
    """Ids of the triangles whose normal is more than 90 degrees from its direction on ``reference`` (V, 3), sorted.

    Give both in the same pose. Against the known answer it counts what turned over; against the rest also what an
    expression turns so far by right.
    """
    before, after = (face_normals(np.asarray(x, dtype=np.float64), triangles) for x in (reference, vertices))
    return np.flatnonzero(np.sum(before * after, axis=1) < 0)
