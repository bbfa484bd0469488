"""What every writer of this package is given: the retargeted performance, as bases and weights and as exact frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.mesh import Polygons, TriangleMesh
from toolkit.meshio.sequence import frame_blocks

__all__ = ["Performance"]

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Performance:
    """A performance to export: T frames of V vertices, spanned by K bases, in the target's unit.

    Parameters
    ----------
    triangles : (F, 3) vertex ids, counter-clockwise seen from outside
    polygons : the faces as they were before triangulation, or None; the formats that can, write these
    rest : (V, 3) the target's neutral
    morphs : (K, V, 3) the full shapes of the bases, with their wrinkles, without head motion
    weights : (T, K); a frame is about ``rest + sum_k weights[t, k] (morphs[k] - rest)``
    rotations, translations : (T, 3, 3) and (T, 3), the head's rigid motion ``p -> R p + t``
    read : ``read(start, stop)`` gives the exact frames ``(stop - start, V, 3)`` float32, with head motion
    fps : frames a second
    name : of the object in the files
    morph_names : K names of the bases; by default basis_00, basis_01, ...
    metres_per_unit : of the target's unit, for USD and glTF, where the user has said it

    Raises
    ------
    ValueError : shapes that do not fit together, or a non-finite coordinate, weight or motion
    """

    triangles: NDArray[np.integer]
    polygons: Polygons | None
    rest: Array
    morphs: Array
    weights: Array
    rotations: Array
    translations: Array
    read: Callable[[int, int], NDArray[np.float32]]
    n_frames: int
    fps: float
    name: str = "performance"
    morph_names: tuple[str, ...] = ()
    metres_per_unit: float | None = None

    def __post_init__(self) -> None:
        n_vertices, n_bases, n_frames = len(self.rest), len(self.morphs), self.n_frames
        expected = {
            "rest": (n_vertices, 3),
            "morphs": (n_bases, n_vertices, 3),
            "weights": (n_frames, n_bases),
            "rotations": (n_frames, 3, 3),
            "translations": (n_frames, 3),
        }
        for name, shape in expected.items():
            values = getattr(self, name)
            if values.shape != shape:
                raise ValueError(f"expected {name} of shape {shape}, got {values.shape}")
            if not np.isfinite(values).all():
                raise ValueError(f"{name} has {np.count_nonzero(~np.isfinite(values))} values that are not finite")
        if self.morph_names and len(self.morph_names) != n_bases:
            raise ValueError(f"expected {n_bases} morph names, got {len(self.morph_names)}")
        if n_frames < 1 or not self.fps > 0:
            raise ValueError(f"expected frames and a positive frame rate, got {n_frames} frames at {self.fps}")

    @property
    def n_vertices(self) -> int:
        """Number of vertices V."""
        return len(self.rest)

    @property
    def n_bytes(self) -> int:
        """Bytes of the exact frames, the neutral and the faces: about what a file of them takes."""
        return 12 * (self.n_frames + 1) * self.n_vertices + 16 * len(self.triangles)

    @property
    def mesh(self) -> TriangleMesh:
        """The target's neutral as a mesh."""
        vertices = np.asarray(self.rest, dtype=np.float64)
        return TriangleMesh(vertices, np.asarray(self.triangles, dtype=np.int32), self.polygons)

    def names_of_morphs(self) -> list[str]:
        """Return the K names, made up where none were given."""
        return list(self.morph_names) or [f"basis_{k:02d}" for k in range(len(self.morphs))]

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Yield ``(start, stop)`` over all frames, in blocks of about 64 MB."""
        return frame_blocks(self.n_frames, self.n_vertices)
