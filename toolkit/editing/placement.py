"""Between the result's place, where users see and ask, and the pose in which the bases live.

A point x of the bases' pose is seen at ``s Q (R_t x + t_t) + c`` in frame t: ``(R_t, t_t)`` the head's motion,
``(s, Q, c)`` the similarity to the target's own place and size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.pose_edit import (
    BeyondConstraint,
    Constraint,
    DistanceConstraint,
    FixedConstraint,
    PointConstraint,
    Residual,
)
from toolkit.rigid import Similarity
from toolkit.stabilisation import HeadMotion

__all__ = ["Placement"]

Array = NDArray[np.float64]


class Placement:
    """Converts constraints to the bases' pose and what comes of them back, frame by frame."""

    def __init__(self, pose: Similarity, motion: HeadMotion) -> None:
        self.scale = pose.scale
        self._rotations = np.asarray(pose.rotation @ motion.rotations)
        self._translations = pose.scale * motion.translations @ pose.rotation.T + pose.translation

    def seen(self, frame: int, points: NDArray[np.floating]) -> Array:
        """Points (n, 3) of the bases' pose as they are seen in a frame."""
        return np.asarray(self.scale * (points @ self._rotations[frame].T) + self._translations[frame])

    def back(self, frame: int, points: NDArray[np.floating]) -> Array:
        """Points (n, 3) of the result in the bases' pose."""
        return np.asarray((points - self._translations[frame]) @ self._rotations[frame] / self.scale)

    def to_bases(self, constraints: Sequence[Constraint]) -> list[Constraint]:
        """Constraints of the result's place in the bases' pose, one for one."""
        return [self._one(constraint) for constraint in constraints]

    def residual(self, constraint: Constraint, found: Residual) -> Residual:
        """A residual in the result's unit; ``constraint`` is the one as the user gave it."""
        return Residual(constraint, found.left * self.scale, found.asked * self.scale)

    def _one(self, constraint: Constraint) -> Constraint:
        if isinstance(constraint, PointConstraint):
            self._check(constraint.frame)
            if constraint.place is not None:
                place = self.back(constraint.frame, np.asarray(constraint.place, dtype=np.float64))
                return replace(constraint, place=_vector(place))
            offset = np.asarray(constraint.offset, dtype=np.float64) @ self._rotations[constraint.frame] / self.scale
            return replace(constraint, offset=_vector(offset))
        if isinstance(constraint, DistanceConstraint):
            length = None if constraint.length is None else constraint.length / self.scale
            return replace(constraint, length=length)
        if isinstance(constraint, BeyondConstraint):
            return replace(constraint, distance=constraint.distance / self.scale)
        assert isinstance(constraint, FixedConstraint)
        return constraint

    def _check(self, frame: int) -> None:
        if not 0 <= frame < len(self._rotations):
            raise InputError(f"there is no frame {frame}", remedy=f"frames go from 0 to {len(self._rotations) - 1}")


def _vector(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z
