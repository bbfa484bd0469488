from __future__ import annotations

import numpy as np
import pytest

from toolkit.editing import EditSession
from toolkit.errors import InputError
from toolkit.pose_edit import EditParameters, PointConstraint
from toolkit.shot import Shot

KEY = 20
NEAR = EditParameters(window=(12, 28))


def pull(vertex: int, offset: tuple[float, float, float]) -> PointConstraint:
    return PointConstraint(KEY, vertex, offset=offset)


def test_a_draft_of_a_change_leaves_the_old_edit_out_and_is_committed_in_its_place(shot: Shot) -> None:
    session = EditSession.open(shot)
    plain = session.frame(KEY)
    session.draft_pose([pull(300, (1.0, 0.0, 0.0))], NEAR)
    first = session.commit()
    session.draft_pose([pull(500, (0.0, 1.0, 0.0))], NEAR)
    second = session.commit()
    without = session.committed_state(first.number).frame(KEY)
    assert np.abs(without - plain)[500].max() > 0.5

    session.draft_pose([pull(300, (-2.0, 0.0, 0.0))], NEAR, instead_of=first.number)
    assert session.frame(KEY)[300, 0] - without[300, 0] == pytest.approx(-2, abs=0.1)
    changed = session.commit("the other way")
    assert (changed.number, changed.data["note"]) == (first.number, "the other way")
    assert [edit.number for edit in session.edits] == [first.number, second.number]
    assert session.frame(KEY)[300, 0] - plain[300, 0] == pytest.approx(-2, abs=0.3)
    session.undo()
    assert session.frame(KEY)[300, 0] - plain[300, 0] == pytest.approx(1, abs=0.2)


def test_states_are_what_the_frames_are_built_from(shot: Shot) -> None:
    session = EditSession.open(shot)
    assert session.state is session.unedited_state
    session.draft_pose([pull(300, (1.0, 0.0, 0.0))], NEAR)
    assert np.array_equal(session.state.frame(KEY), session.frame(KEY))
    assert session.committed_state() is session.unedited_state
    session.drop_draft()
    assert session.state is session.unedited_state


def test_a_draft_of_a_change_needs_an_edit(shot: Shot) -> None:
    session = EditSession.open(shot)
    session.draft_pose([pull(300, (1.0, 0.0, 0.0))], NEAR, instead_of=7)
    with pytest.raises(InputError, match="no edit 7"):
        session.commit()
