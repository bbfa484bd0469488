"""Spacetime pose editing: change one frame, the performance follows (the paper's section 4.3, Eqs. 12-15).

How a session calls it, once the transfer has made ``system`` (a `DeformationTransfer`) and the bases::

    seen = VisibleDetails(target_decomposer, details, gain)
    take = EditableTake(rest, bases - rest, weights, system, seen)
    editor = PoseEditor(take, triangles)
    pull = PointConstraint(frame=120, vertex=4711, offset=(0.0, 0.3, 0.0))
    edit = editor.solve([pull], EditParameters(window=(90, 150)), warm=True)   # while the pointer moves
    edit.smooth_frame(120)                                                    # only the asked frame
    edit = editor.solve([pull], EditParameters(window=(90, 150)))             # on release: the same on every run
    edit.residuals                                                            # one for each constraint
    next_editor = PoseEditor(edit.take, triangles)                            # edits stack

Places are in the pose and size of the bases, on the visible surface; the details are taken as they lie on the frame
before the edit, since their turn by the edit is of second order. What the user commits goes to `toolkit.shot.journal`
(`to_data` and `from_data`); edits that are switched off, changed or removed are left out when the stack is solved again
from the first.
"""

from toolkit.pose_edit.constraints import (
    BeyondConstraint,
    Constraint,
    DistanceConstraint,
    FixedConstraint,
    PointConstraint,
)
from toolkit.pose_edit.contacts import TouchingPairs
from toolkit.pose_edit.data import from_data, to_data
from toolkit.pose_edit.details import VisibleDetails
from toolkit.pose_edit.parameters import EditParameters
from toolkit.pose_edit.result import PoseEdit, Residual
from toolkit.pose_edit.solver import PoseEditor
from toolkit.pose_edit.take import EditableTake, LowRankMoves

__all__ = [
    "BeyondConstraint",
    "Constraint",
    "DistanceConstraint",
    "EditParameters",
    "EditableTake",
    "FixedConstraint",
    "LowRankMoves",
    "PointConstraint",
    "PoseEdit",
    "PoseEditor",
    "Residual",
    "TouchingPairs",
    "VisibleDetails",
    "from_data",
    "to_data",
]
