from __future__ import annotations

import json
import threading

import numpy as np
import pytest

from toolkit.editing import EditSession
from toolkit.errors import InputError
from toolkit.pose_edit import (
    BeyondConstraint,
    DistanceConstraint,
    EditParameters,
    FixedConstraint,
    PointConstraint,
)
from toolkit.shot import Shot
from toolkit.stages import run_stages

KEY = 20
NEAR = EditParameters(window=(12, 28))


def vertex_at(session: EditSession, share_x: float, share_y: float) -> int:
    """A vertex by its place on the 24 x 31 grid."""
    return round(share_x * 23) * 31 + round(share_y * 30)


def pull(session: EditSession, size: float = 0.03, at: tuple[float, float] = (0.5, 0.5), **more) -> PointConstraint:
    """A pull by a share of the face's diagonal."""
    diagonal = float(np.linalg.norm(np.ptp(session.rest, axis=0)))
    return PointConstraint(KEY, vertex_at(session, *at), offset=(0.0, size * diagonal, 0.0), **more)


def all_frames(session: EditSession) -> np.ndarray:
    return np.stack([session.frame(t) for t in range(session.n_frames)])


def test_without_edits_it_is_the_result(shot: Shot) -> None:
    session = EditSession.open(shot)
    result = shot.array("result", "frames")
    assert (session.n_frames, session.n_vertices) == result.shape[:2]
    assert (session.n_bases, session.fps) == (4, 30.0)
    assert np.abs(all_frames(session) - result).max() < 1e-5
    assert np.array_equal(session.frame(7), session.unedited_frame(7))
    assert np.array_equal(session.source_frame(7), np.load(shot.path / "take.npy")[7])
    assert session.edits == ()
    assert session.can_undo is None
    assert session.can_redo is None
    assert not session.edited_frames().any()


@pytest.mark.parametrize("extra", ["", '[details]\nmethod = "coating"\n', "[details]\ngain = 1.7\n"])
def test_points_land_where_they_are_put_on_the_moved_and_scaled_face(make, extra: str) -> None:
    """Places and offsets are those of the frames that the user sees: size, place, head motion and details in them."""
    session = EditSession.open(make(extra))
    before = session.frame(KEY)
    offset = pull(session)
    session.draft_pose([offset], NEAR)
    moved = session.frame(KEY)[offset.vertex] - before[offset.vertex]
    asked = np.array(offset.offset)
    assert np.abs(moved - asked).max() < 0.03 * np.abs(asked).max()
    place = tuple(float(x) for x in before[offset.vertex] + asked)
    edit = session.draft_pose([PointConstraint(KEY, offset.vertex, place=place)], NEAR)
    left = np.linalg.norm(session.frame(KEY)[offset.vertex] - place)
    assert left < 0.04 * np.abs(asked).max()  # the details, large ones here, turn with the edit
    assert edit.residuals[0].asked == pytest.approx(np.linalg.norm(asked), rel=0.02)
    assert edit.residuals[0].left < 0.01 * edit.residuals[0].asked


def test_distances_are_in_the_results_unit(shot: Shot) -> None:
    session = EditSession.open(shot)
    a, b = vertex_at(session, 0.4, 0.5), vertex_at(session, 0.6, 0.5)

    def length() -> float:
        points = session.frame(KEY)
        return float(np.linalg.norm(points[a] - points[b]))

    wanted = 1.2 * length()
    session.draft_pose([DistanceConstraint(KEY, (a, b), length=wanted)], NEAR)
    assert length() == pytest.approx(wanted, rel=0.01)
    session.draft_pose([DistanceConstraint(KEY, (a, b), factor=0.9)], NEAR)
    assert length() == pytest.approx(0.9 * wanted / 1.2, rel=0.01)


def test_everything_beyond_a_distance_stays(shot: Shot) -> None:
    session = EditSession.open(shot)
    before = all_frames(session)
    diagonal = float(np.linalg.norm(np.ptp(session.rest, axis=0)))
    pulled = pull(session, at=(0.5, 0.2))
    edit = session.draft_pose([pulled, BeyondConstraint(0.2 * diagonal)], EditParameters())
    moved = np.linalg.norm(all_frames(session) - before, axis=2)
    far = np.linalg.norm(session.rest - session.rest[pulled.vertex], axis=1) > 0.25 * diagonal
    assert moved[KEY, pulled.vertex] > 0.02 * diagonal
    assert moved[:, far].max() < 0.01 * moved[KEY, pulled.vertex]
    assert len(edit.residuals) == 2


def test_a_draft_shows_and_leaves_nothing_behind(shot: Shot) -> None:
    session = EditSession.open(shot)
    before = all_frames(session)
    session.draft_pose([pull(session)], EditParameters(mode="weights", window=(12, 28)))
    shown = all_frames(session)
    assert session.has_draft
    assert np.abs(shown[KEY] - before[KEY]).max() > 0.1
    assert np.array_equal(np.delete(shown, np.s_[12:29], axis=0), np.delete(before, np.s_[12:29], axis=0))
    assert (session.edited_weights != session.weights).any()
    assert (session.edited_frames() > 0).tolist() == [12 <= t <= 28 for t in range(40)]
    session.drop_draft()
    assert np.array_equal(all_frames(session), before)
    assert not shot.edits_path.exists()
    with pytest.raises(InputError, match="no draft"):
        session.commit()


def test_commit_is_the_same_after_a_restart(shot: Shot) -> None:
    session = EditSession.open(shot)
    for size in (0.01, 0.02, 0.03):
        session.draft_pose([pull(session, size)], NEAR)
    edit = session.commit("a bump")
    assert json.loads(shot.edits_path.read_text())["data"]["note"] == "a bump"
    assert (edit.number, edit.kind, edit.on, session.has_draft) == (1, "pose", True, False)
    again = EditSession.open(Shot(shot.path))
    assert again.edits == session.edits
    assert np.array_equal(all_frames(again), all_frames(session))
    assert again.residuals(1) == session.residuals(1)


def test_undo_and_redo_across_restarts(shot: Shot) -> None:
    session = EditSession.open(shot)
    plain = session.frame(KEY)
    shown = [plain]
    for at in ((0.3, 0.5), (0.7, 0.5)):
        session.draft_pose([pull(session, at=at)], NEAR)
        session.commit()
        shown.append(session.frame(KEY))
    assert session.can_undo == "add pose edit 2"
    for expected in (shown[1], shown[0]):
        session = EditSession.open(Shot(shot.path))
        session.undo()
        assert np.array_equal(session.frame(KEY), expected)
    assert session.can_undo is None
    assert session.undo() is None
    session = EditSession.open(Shot(shot.path))
    session.redo()
    session.redo()
    assert np.array_equal(session.frame(KEY), shown[2])
    assert session.can_redo is None


def test_edits_stack_and_each_can_be_switched_off_changed_and_removed(shot: Shot) -> None:
    session = EditSession.open(shot)
    places = [(0.25, 0.3), (0.75, 0.7)]
    alone = []
    for at in places:
        session.draft_pose([pull(session, at=at)], NEAR, warm=False)
        alone.append(session.frame(KEY))
    for at in places:
        session.draft_pose([pull(session, at=at)], NEAR)
        session.commit()
    both = session.frame(KEY)
    session.switch(1, False)
    assert np.array_equal(session.frame(KEY), alone[1])
    assert session.can_undo == "switch off pose edit 1"
    session.switch(1, True)
    assert np.array_equal(session.frame(KEY), both)
    session.remove(2)
    assert np.array_equal(session.frame(KEY), alone[0])
    session.undo()
    data = json.loads(json.dumps(session.edits[0].data))
    data["constraints"][0]["offset"][1] *= -1
    session.change(1, data)
    v, w = (vertex_at(session, *at) for at in places)
    # On top of the changed edit the later one still does what it was asked.
    assert session.residuals(2)[0].left < 0.01 * session.residuals(2)[0].asked
    on_top = session.frame(KEY)
    session.switch(2, False)
    flipped = session.frame(KEY)
    assert (on_top[w] - flipped[w])[1] == pytest.approx((alone[1] - session.unedited_frame(KEY))[w, 1], rel=0.05)
    plain = session.unedited_frame(KEY)
    assert (flipped[v] - plain[v])[1] == pytest.approx(-(alone[0][v] - plain[v])[1], rel=0.05)
    with pytest.raises(InputError, match="no edit 7"):
        session.switch(7, False)


def test_an_impossible_edit_changes_nothing(shot: Shot) -> None:
    session = EditSession.open(shot)
    session.draft_pose([pull(session)], NEAR)
    session.commit()
    before, journal = session.frame(KEY), shot.edits_path.read_bytes()
    with pytest.raises(InputError, match="no frame 99"):
        session.draft_pose([PointConstraint(99, 3, offset=(1.0, 0.0, 0.0))])
    with pytest.raises(InputError, match="no vertex"):
        session.add("pose", {"constraints": [{"kind": "point", "frame": 2, "vertex": 10**6, "offset": [0, 0, 1]}]})
    with pytest.raises(InputError, match="unknown"):
        session.add("magic", {})
    with pytest.raises(InputError, match="window"):
        session.change(1, {**session.edits[0].data, "parameters": {"window": [3, 99]}})
    assert np.array_equal(session.frame(KEY), before)
    assert shot.edits_path.read_bytes() == journal


def test_a_cancel_leaves_what_was(shot: Shot) -> None:
    session = EditSession.open(shot)
    session.draft_pose([pull(session)], NEAR)
    before = session.frame(KEY)

    def cancel(what: str, done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        session.draft_pose([pull(session, 0.1)], NEAR, progress=cancel)
    with pytest.raises(KeyboardInterrupt):
        session.commit(progress=cancel)
    assert np.array_equal(session.frame(KEY), before)
    assert not shot.edits_path.exists()
    session.commit()
    assert session.residuals(1)[0].left < 0.01 * session.residuals(1)[0].asked


def test_what_an_older_shot_cannot_do_any_more_is_told_and_passed_over(shot: Shot) -> None:
    session = EditSession.open(shot)
    session.draft_pose([pull(session)], NEAR)
    session.commit()
    good = session.frame(KEY)
    shot.edits_path.open("a").write(
        '{"number": 2, "step": "add", "kind": "pose", "data": {"constraints": '
        '[{"kind": "point", "frame": 4000, "vertex": 3, "offset": [0, 0, 1]}]}}\n'
    )
    session = EditSession.open(shot)
    assert np.array_equal(session.frame(KEY), good)
    assert "no frame 4000" in (session.problem(2) or "")
    assert session.residuals(2) == ()
    session.remove(2)
    assert len(session.edits) == 1


def test_contradictions_are_told_by_residuals(shot: Shot) -> None:
    session = EditSession.open(shot)
    up = pull(session)
    down = PointConstraint(KEY, up.vertex, offset=tuple(-x for x in up.offset))  # type: ignore[arg-type,union-attr]
    session.draft_pose([up, down], NEAR)
    session.commit()
    for residual in session.residuals(1):
        assert residual.left == pytest.approx(residual.asked, rel=0.1)


def test_stages_have_to_be_up_to_date(shot: Shot) -> None:
    toml = shot.path / "shot.toml"
    toml.write_text(toml.read_text() + "[transfer]\ncontact_weight = 3.0\n")
    with pytest.raises(InputError, match='"transfer" is missing or older'):
        EditSession.open(Shot(shot.path))
    run_stages(Shot(shot.path), ["transfer"])
    EditSession.open(Shot(shot.path))


def test_threads_may_draft_and_look_at_once(shot: Shot) -> None:
    session = EditSession.open(shot)
    pulled = pull(session)
    wrong: list[str] = []

    def look() -> None:
        for t in range(40):
            frame = session.frame(t)
            if not np.isfinite(frame).all():
                wrong.append(f"frame {t}")

    lookers = [threading.Thread(target=look) for _ in range(3)]
    for looker in lookers:
        looker.start()
    for _ in range(5):
        session.draft_pose([pulled, FixedConstraint((0, 30))], NEAR)
        session.drop_draft()
    for looker in lookers:
        looker.join()
    assert not wrong
