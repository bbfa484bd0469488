"""Wrinkle editing: select, change, move and reshape details over time (the paper's section 5.2; method, section 8).

How a session calls it::

    take = DetailTake(mesh, smooth, neighbour, frames0, details, gain, static)
    region = within(take.surface, curve, distance)                # or painted, grown, shrunk, ...
    edit = ScaleEdit(region=region, frame=120, factor=0.0)        # remove the wrinkle of frame 120
    change = solve_detail_edit(edit, take)
    change.apply(details, start, vertices)                        # on blocks of g s d_t at some vertices, in place
    change.apply_static(static, vertices)                         # on e_0'
    further = take.changed(change)                                # edits stack

What the user commits goes to the journal as `to_data(edit)`, and comes back by `from_data`.
"""

from toolkit.detail_edit.change import DetailChange
from toolkit.detail_edit.curves import drawn, snapped
from toolkit.detail_edit.data import (
    from_data,
    regions_from_data,
    regions_to_data,
    to_data,
)
from toolkit.detail_edit.edits import DetailEdit, GainEdit, KeyedEdit, PasteEdit, ReshapeEdit, ScaleEdit
from toolkit.detail_edit.mirror import Mirror
from toolkit.detail_edit.region import Dab, Region, banded, grown, middle_of, painted, shrunk, within
from toolkit.detail_edit.solve import solve_detail_edit
from toolkit.detail_edit.surface import Curve, Surface, SurfacePoint
from toolkit.detail_edit.take import DetailTake
from toolkit.detail_edit.window import find_window

__all__ = [
    "Curve",
    "Dab",
    "DetailChange",
    "DetailEdit",
    "DetailTake",
    "GainEdit",
    "KeyedEdit",
    "Mirror",
    "PasteEdit",
    "Region",
    "ReshapeEdit",
    "ScaleEdit",
    "Surface",
    "SurfacePoint",
    "banded",
    "drawn",
    "find_window",
    "from_data",
    "grown",
    "middle_of",
    "painted",
    "regions_from_data",
    "regions_to_data",
    "shrunk",
    "snapped",
    "solve_detail_edit",
    "to_data",
    "within",
]
