"""The ICT pair: a performer with wrinkles, and another person with the known answer, wrinkles of their own included."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh, vertex_normals

__all__ = ["IctPair"]

Array = NDArray[np.float64]


class IctPair:
    """Both faces on the performer's topology, in centimetres.

    ``bake`` is the data's own code: its ``Performer`` makes the source's frames. The other person's expressions are
    the true correspondence plus the same offsets, and their wrinkles come from bake's own rule on their own skin.
    """

    def __init__(self, folder: Path) -> None:
        performer, other = folder / "ict_performer", folder / "targets" / "ict_identity" / "true_correspondence.npy"
        for needed in (performer / "bake.py", other):
            if not needed.exists():
                raise InputError("there is no such file", where=needed, remedy="give --ict the folder with both faces")
        self._bake = _module(performer / "bake.py")
        self.performer: Any = self._bake.Performer()
        self.weights: Array = np.load(performer / "weights_take180.npy").astype(np.float64)
        self.feature_lines = performer / "feature_lines.json"
        self.triangles = np.ascontiguousarray(self.performer.triangles, dtype=np.int32)
        self._neutral = np.load(other).astype(np.float64)
        vector = self._neutral[self.performer.edges[:, 1]] - self._neutral[self.performer.edges[:, 0]]
        self._rest_length = np.linalg.norm(vector, axis=1)

    def source(self) -> TriangleMesh:
        """The performer at rest."""
        return TriangleMesh(self.performer.frame(np.zeros(self.weights.shape[1])), self.triangles)

    def target(self) -> TriangleMesh:
        """The other person at rest."""
        return TriangleMesh(self._neutral, self.triangles)

    def answer(self, weights: Array) -> Array:
        """The other person in an expression, with their own wrinkles, ``(V, 3)``."""
        points = self._other(weights)
        return self._folded(points, self._active(points, self._rest_length))

    def source_with_answers_depth(self, weights: Array) -> Array:
        """The performer with wrinkles as deep as the other person's, ``(V, 3)``: what no transfer can know."""
        points = self.performer.subdivide @ (
            self.performer.neutral + np.tensordot(weights, self.performer.expressions, 1)
        )
        active = self._active(self._other(weights), self._rest_length)
        return self._folded(points, active) + self.performer.static[:, None] * vertex_normals(points, self.triangles)

    def _other(self, weights: Array) -> Array:
        offset = self.performer.subdivide @ np.tensordot(weights, self.performer.expressions, 1)
        return np.asarray(self._neutral + offset)

    def _active(self, points: Array, rest_length: Array) -> Array:
        """How far the wrinkles are out, 0..1, as bake.py has it."""
        edges, onset, full = self.performer.edges, self._bake.ONSET, self._bake.FULL
        length = np.linalg.norm(points[edges[:, 1]] - points[edges[:, 0]], axis=1)
        strain = self.performer.gather @ (length / rest_length - 1)
        for _ in range(10):
            strain = self.performer.average @ strain
        return np.clip((-strain - onset) / (full - onset), 0, 1)

    def _folded(self, points: Array, active: Array) -> Array:
        relief = self._bake.WRINKLE_CM * active * self.performer.carrier
        return np.asarray(points + relief[:, None] * vertex_normals(points, self.triangles))


def _module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("ict_bake", path)
    if spec is None or spec.loader is None:
        raise InputError("this is no Python file", where=path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
