from __future__ import annotations

import json

import numpy as np
import pytest

from toolkit.detail_edit import GainEdit, Region, ScaleEdit
from toolkit.editing import EditSession
from toolkit.errors import InputError
from toolkit.export.gltf import morph_deviation
from toolkit.pose_edit import EditParameters, PointConstraint
from toolkit.progress import silent
from toolkit.shot import Shot
from toolkit.shot.journal import Journal
from toolkit.stages import STAGES, run_stages
from toolkit.stages.performance import load_performance

KEY = 20
MIDDLE = 12 * 31 + 15


def commit_pull(session: EditSession, mode: str = "both", window: tuple[int, int] = (12, 28)) -> None:
    diagonal = float(np.linalg.norm(np.ptp(session.rest, axis=0)))
    pull = PointConstraint(KEY, MIDDLE, offset=(0.0, 0.03 * diagonal, 0.01 * diagonal))
    session.draft_pose([pull], EditParameters(mode=mode, window=window))
    session.commit()


def wrinkles(factor: float) -> ScaleEdit:
    near = (np.arange(8, 16)[:, None] * 31 + np.arange(10, 20)).ravel()
    return ScaleEdit(region=Region.whole(near), frame=KEY, factor=factor, window=(14, 26))


def ran(shot: Shot) -> list[str]:
    return [report.stage for report in run_stages(Shot(shot.path)) if not report.skipped]


def test_only_the_result_is_made_again_and_without_edits_it_is_what_it_was(shot: Shot) -> None:
    before = shot.frames_path.read_bytes()
    assert ran(shot) == []
    session = EditSession.open(shot)
    commit_pull(session)
    assert ran(shot) == ["result"]
    assert shot.frames_path.read_bytes() != before
    assert ran(shot) == []
    session.switch(1, False)
    assert ran(shot) == ["result"]
    assert shot.frames_path.read_bytes() == before
    assert not (shot.path / "result" / "edits.json").exists()
    session.undo()
    session.write_result()
    assert ran(shot) == []
    session.undo()
    assert ran(shot) == ["result"]
    assert shot.frames_path.read_bytes() == before
    assert ran(shot) == []
    assert list(STAGES)[-1] == "result"


@pytest.mark.parametrize("extra", ["", '[details]\nmethod = "coating"\n'])
def test_the_stage_writes_what_the_session_shows(make, extra: str) -> None:
    shot = make(extra)
    session = EditSession.open(shot)
    commit_pull(session)
    session.draft_detail(wrinkles(-1.0))
    session.commit()
    session.write_result()
    written = np.array(shot.array("result", "frames"))
    shown = np.stack([session.frame(t) for t in range(session.n_frames)])
    assert np.abs(written - shown).max() < 1e-5
    assert np.array_equal(shot.array("result", "weights"), session.edited_weights)
    assert np.array_equal(shot.array("result", "moved"), session.edited_frames())
    record = json.loads((shot.path / "result" / "edits.json").read_text())["edits"]
    assert [one["kind"] for one in record] == ["pose", "detail"]
    assert record[0]["residuals"][0]["left"] == session.residuals(1)[0].left
    again = EditSession.open(Shot(shot.path))
    run_stages(shot, ["result"], force=True)
    assert np.array_equal(shot.array("result", "frames"), written)
    assert np.array_equal(again.edited_weights, session.edited_weights)


def test_frames_outside_every_edit_stay_bit_for_bit(shot: Shot) -> None:
    before = np.array(shot.array("result", "frames"))
    session = EditSession.open(shot)
    commit_pull(session, mode="weights")
    session.draft_detail(wrinkles(2.0))
    session.commit()
    session.write_result()
    after = shot.array("result", "frames")
    same = [bool(np.array_equal(a, b)) for a, b in zip(before, after, strict=True)]
    assert same == [not 12 <= t <= 28 for t in range(40)]
    assert np.array_equal(session.frame(3), session.unedited_frame(3))


def test_a_detail_edit_changes_its_region_alone(shot: Shot) -> None:
    session = EditSession.open(shot)
    edit = wrinkles(0.0)
    change = session.draft_detail(edit)
    apart = np.abs(session.frame(KEY) - session.unedited_frame(KEY)).max(axis=1)
    others = np.setdiff1d(np.arange(session.n_vertices), change.vertices)
    assert apart[edit.region.vertices].max() > 0
    assert apart[others].max() == 0
    moved = session.edited_frames()
    apart = np.linalg.norm(session.frame(KEY) - session.unedited_frame(KEY), axis=1)
    assert moved[KEY] == pytest.approx(apart.max(), rel=1e-3)


def test_the_order_of_pose_and_detail_edits_does_not_matter(make) -> None:
    frames = []
    for detail_first in (True, False):
        session = EditSession.open(make())
        for detail in (detail_first, not detail_first):
            if detail:
                session.draft_detail(wrinkles(-2.0))
                session.commit()
            else:
                commit_pull(session)
        frames.append(session.frame(KEY))
    assert np.array_equal(frames[0], frames[1])


def test_static_details_and_gains_join_the_stack(shot: Shot) -> None:
    session = EditSession.open(shot)
    session.draft_detail(GainEdit(gains=((0, 3.0),), details="static"))
    session.commit()
    assert all(not np.array_equal(session.frame(t), session.unedited_frame(t)) for t in (0, 39))
    assert (session.edited_frames() > 0).all()
    session.switch(1, False)
    assert not session.edited_frames().any()


def test_the_gltf_holds_the_edited_bases(shot: Shot) -> None:
    before = morph_deviation(load_performance(shot), silent)
    session = EditSession.open(shot)
    commit_pull(session)
    with pytest.raises(InputError, match="older than"):
        load_performance(shot)
    session.write_result()
    performance = load_performance(shot)
    after = morph_deviation(performance, silent)
    moved = float(session.edited_frames().max())
    assert after[1] < before[1] + 0.05 * moved
    assert np.array_equal(performance.weights, session.edited_weights)


def test_an_edit_that_cannot_be_applied_stops_the_stage_and_keeps_the_old_result(shot: Shot) -> None:
    before = shot.frames_path.read_bytes()
    Journal(shot.edits_path).add(
        "pose", {"constraints": [{"kind": "point", "frame": 0, "vertex": -3, "offset": [1, 0, 0]}]}
    )
    with pytest.raises(InputError, match=r"edit 1: the edit cannot be applied.*off 1"):
        run_stages(shot)
    assert shot.frames_path.read_bytes() == before
