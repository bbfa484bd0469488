"""Editing a shot in space and time: pose edits and detail edits in one stack, with a journal, undo and redo.

`EditSession` is all that the viewer and scripts/6_edit.py need::

    session = EditSession.open(Shot("myshot"))
    pull = PointConstraint(frame=120, vertex=4711, offset=(0.0, 0.3, 0.0))    # as the user sees it, details included
    session.draft_pose([pull], EditParameters(window=(90, 150)))              # while the pointer moves
    session.frame(120)                                                        # only the asked frame is built
    session.commit("a higher brow")                                           # on disk when it returns
    session.undo()
    session.write_result()                                                    # result/frames.npy
"""

from toolkit.editing.session import EditSession

__all__ = ["EditSession"]
