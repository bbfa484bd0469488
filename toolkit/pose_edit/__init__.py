"""Spacetime pose editing: change one frame, the performance follows (the paper's section 4.3, Eqs. 12-15).

How a session calls it, once the transfer has made ``system`` (a `DeformationTransfer`) and the bases::

    take = EditableTake(rest, bases - rest, weights, system, detail_offset)
    editor = PoseEditor(take, triangles)
    pull = PointConstraint(frame=120, vertex=4711, offset=(0.0, 0.3, 0.0))
    edit = editor.solve([pull], EditParameters(window=(90, 150)), warm=True)   # while the pointer moves
    edit.smooth_frame(120)                                                    # only the asked frame
    edit = editor.solve([pull], EditParameters(window=(90, 150)))             # on release: the same on every run
    edit.residuals                                                            # one for each constraint
    next_editor = PoseEditor(edit.take, triangles)                            # edits stack

Places are in the pose and size of the bases, on the visible surface: ``detail_offset(frame, vertices)`` says what the
details add there. What the user commits goes to `toolkit.shot.journal`; edits that are switched off, changed or removed
are left out when the stack is solved again from the first.
"""

from toolkit.pose_edit.constraints import Constraint, DistanceConstraint, FixedConstraint, PointConstraint
from toolkit.pose_edit.parameters import EditParameters
from toolkit.pose_edit.result import PoseEdit, Residual
from toolkit.pose_edit.solver import PoseEditor
from toolkit.pose_edit.take import EditableTake, LowRankMoves

__all__ = [
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
]
