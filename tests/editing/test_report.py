from __future__ import annotations

import numpy as np

from toolkit.editing import EditSession
from toolkit.editing.preview import preview_sheet
from toolkit.pose_edit import EditParameters, PointConstraint
from toolkit.rendering.shots import open_views
from toolkit.report.edits import edits_section
from toolkit.shot import Shot


def test_the_report_tells_what_was_asked_and_what_moved(shot: Shot) -> None:
    views = open_views(shot)
    assert edits_section(shot, views) is None
    session = EditSession.open(shot)
    diagonal = float(np.linalg.norm(np.ptp(session.rest, axis=0)))
    pull = PointConstraint(20, 12 * 31 + 15, offset=(0.0, 0.05 * diagonal, 0.0))
    session.draft_pose([pull], EditParameters(window=(12, 28), lambda_w=0.1))
    session.commit("higher <here>")
    session.write_result()
    section = edits_section(shot, open_views(shot))
    assert section is not None
    assert f"Point: {0.05 * diagonal:.3g} asked" in section.notes[0]
    assert "(higher <here>)" in section.notes[0]
    assert len(section.charts) >= 2
    assert len(section.figures) == 1


def test_a_preview_shows_nothing_moved_without_edits(shot: Shot) -> None:
    session, views = EditSession.open(shot), open_views(shot)
    plain = preview_sheet(views, [3, 20], session.unedited_frame, session.frame, width=60)
    pull = PointConstraint(20, 12 * 31 + 15, offset=(0.0, 1.0, 1.0))
    session.draft_pose([pull], EditParameters(mode="weights", window=(12, 28)))
    edited = preview_sheet(views, [3, 20], session.unedited_frame, session.frame, width=60)
    assert plain.shape == edited.shape
    assert (plain != edited).any()
