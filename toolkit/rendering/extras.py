"""What belongs into the pictures beside the skin: eyeballs, teeth; stiff meshes that ride with the head's motion.

They are no part of the transfer: a shot names them in ``shot.toml`` (``extras`` of [source] and of [target]), in the
place of the reference mesh beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.meshio import read_mesh
from toolkit.rendering.shading import IVORY, Material
from toolkit.stabilisation import HeadMotion

__all__ = ["Extras", "load_extras"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Extras:
    """Stiff meshes of one performance: ``triangles`` (F, 3), ``rest`` (N, 3) beside the neutral, the head's motion."""

    triangles: NDArray[np.int32]
    rest: Array
    motion: HeadMotion
    material: Material = IVORY

    def frame(self, index: int) -> Array:
        """Positions ``(N, 3)`` in one frame of the take."""
        return np.asarray(self.rest @ self.motion.rotations[index].T + self.motion.translations[index])


def load_extras(paths: Sequence[Path], motion: HeadMotion) -> Extras | None:
    """Read the meshes and put them together; None where there are none. Raises InputError on what cannot be read."""
    if not paths:
        return None
    vertices, triangles, count = [], [], 0
    for path in paths:
        mesh = read_mesh(path)
        if not np.isfinite(mesh.vertices).all():
            raise InputError("this mesh has vertices without a finite position", where=path, remedy="export it again")
        vertices.append(mesh.vertices)
        triangles.append(mesh.triangles + count)
        count += mesh.n_vertices
    return Extras(np.concatenate(triangles).astype(np.int32), np.concatenate(vertices), motion)
