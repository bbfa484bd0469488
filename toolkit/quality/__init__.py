"""What can be measured on a result, as pure functions on arrays: contacts, crossings, unrest, errors, details."""

from toolkit.quality.crossings import crossing_triangles, rim_neighbourhood
from toolkit.quality.gaps import ContactGaps, contact_gaps, inner_rim, rim_gaps
from toolkit.quality.motion import Jitter, MotionError, jitter, motion_error, second_differences, unrest
from toolkit.quality.surface import DetailError, coating_energy, detail_error, flipped_triangles

__all__ = [
    "ContactGaps",
    "DetailError",
    "Jitter",
    "MotionError",
    "coating_energy",
    "contact_gaps",
    "crossing_triangles",
    "detail_error",
    "flipped_triangles",
    "inner_rim",
    "jitter",
    "motion_error",
    "rim_gaps",
    "rim_neighbourhood",
    "second_differences",
    "unrest",
]
