"""What can be measured on a result, as pure functions on arrays: contacts, crossings, unrest, errors, details."""

from toolkit.quality.crossings import crossing_triangles, rim_neighbourhood
from toolkit.quality.gaps import ContactGaps, contact_gaps, inner_rim, rim_gaps
from toolkit.quality.motion import (
    Jitter,
    MotionError,
    Unsteadiness,
    face_parts,
    jitter,
    motion_error,
    unexplained_trembling,
    unrest,
    unsteadiness,
)
from toolkit.quality.surface import DetailError, coating_energy, detail_energy, detail_error, flipped_triangles

__all__ = [
    "ContactGaps",
    "DetailError",
    "Jitter",
    "MotionError",
    "Unsteadiness",
    "coating_energy",
    "contact_gaps",
    "crossing_triangles",
    "detail_energy",
    "detail_error",
    "face_parts",
    "flipped_triangles",
    "inner_rim",
    "jitter",
    "motion_error",
    "rim_gaps",
    "rim_neighbourhood",
    "unexplained_trembling",
    "unrest",
    "unsteadiness",
]
