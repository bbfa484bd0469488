"""What can be set about the registration, with the values that came out best on five faces with known answers."""

from __future__ import annotations

from dataclasses import dataclass

from toolkit.errors import InputError

__all__ = ["RegistrationParameters"]


@dataclass(frozen=True)
class RegistrationParameters:
    """Parameters of `toolkit.registration.register`.

    ``resolution``: vertices of the decimated source on which the field is solved.
    ``stiffness_first``, ``stiffness_last``, ``stiffness_steps``, ``rounds``: weight of the field's bending, from the
    first to the last by equal factors, and rounds of closest points at each.
    ``membrane``: share of stretching in the field's energy, beside bending.
    ``landmark_weight``, ``line_weight``: against 1 for a closest point.
    ``max_angle``: degrees between the normals of a vertex and of its closest point.
    ``max_distance``: of a closest point, as a share of the landmarks' extent.
    ``max_flips``: share of the skin's triangles that may be turned over before the result is refused.
    ``project``: put the skin on the target's surface in the end, so that its pores and wrinkles are resampled.
    """

    resolution: int = 8000
    stiffness_first: float = 1000.0
    stiffness_last: float = 10.0
    stiffness_steps: int = 5
    rounds: int = 3
    membrane: float = 0.003
    landmark_weight: float = 100.0
    line_weight: float = 5.0
    max_angle: float = 60.0
    max_distance: float = 0.06
    max_flips: float = 0.05
    project: bool = True

    def __post_init__(self) -> None:
        for name in ("resolution", "stiffness_steps", "rounds"):
            if getattr(self, name) < 1:
                raise InputError(f"register.{name} is {getattr(self, name)}", remedy="give a whole number from 1 on")
        for name in ("stiffness_first", "stiffness_last", "landmark_weight", "max_angle", "max_distance"):
            if not getattr(self, name) > 0:
                raise InputError(f"register.{name} is {getattr(self, name)}", remedy="give a number above zero")
        for name in ("membrane", "line_weight", "max_flips"):
            if not getattr(self, name) >= 0:
                raise InputError(f"register.{name} is {getattr(self, name)}", remedy="give zero or more")
