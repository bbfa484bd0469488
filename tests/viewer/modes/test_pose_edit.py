from __future__ import annotations

import json
import threading
from dataclasses import replace

import numpy as np
import pytest

from tests.viewer.modes.conftest import KEY, MIDDLE, edits
from toolkit.pose_edit import BeyondConstraint, DistanceConstraint, EditParameters, FixedConstraint, PointConstraint
from toolkit.shot import Shot
from viewer.modes.pose.draft import PoseDraft
from viewer.state.events import Command, Key, PanelInput, TimelineInput
from viewer.state.marks import Disc


def test_a_drag_moves_the_vertex_in_the_view_plane_and_commit_writes_it(pose, shot: Shot) -> None:
    app, mode = pose.app, pose.app.mode
    app.set_view(1, replace(app.views[0], azimuth=25.0, elevation=10.0))
    plain = app.surface(1).vertices[MIDDLE].astype(float)
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 20, at[1] - 12))
    moved = app.surface(1).vertices[MIDDLE] - plain
    assert pose.pixel_of(MIDDLE) == pytest.approx((at[0] + 20, at[1] - 12), abs=0.5)
    assert abs(moved @ app.framing_camera(1).axes()[2]) < 0.02 * np.linalg.norm(moved)
    assert mode.draft.handles[0].vertex == MIDDLE
    assert edits(shot) == ()

    app.handle(Key("enter"))
    pose.wait()
    (edit,) = edits(shot)
    assert (edit.kind, edit.data["constraints"][0]["vertex"], edit.data["constraints"][0]["frame"]) == (
        "pose",
        MIDDLE,
        KEY,
    )
    assert mode.draft is None
    assert app.editing.session.frame(KEY)[MIDDLE] - plain == pytest.approx(moved, abs=0.02 * np.linalg.norm(moved))


def test_while_dragging_only_the_newest_place_is_solved_for(pose) -> None:
    app, asked, go = pose.app, [], threading.Event()
    solve = app.editing.session.draft_pose

    def counted(constraints, *rest, **more):
        asked.append(constraints[0].offset)
        go.wait(30)
        return solve(constraints, *rest, **more)

    app.editing.session.draft_pose = counted
    at = pose.pixel_of(MIDDLE)
    pose.send("press", *at)
    for step in range(1, 31):  # all before the worker has answered once
        pose.send("drag", at[0] + 2 * step, at[1])
    go.set()
    pose.send("release", at[0] + 60, at[1])
    pose.wait()
    assert len(asked) <= 3
    assert pose.pixel_of(MIDDLE)[0] == pytest.approx(at[0] + 60, abs=1.5)


def test_a_handle_can_be_dragged_again_and_a_click_holds_a_point_where_it_is(pose) -> None:
    app, mode = pose.app, pose.app.mode
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 30, at[1]))
    pose.drag((at[0] + 30, at[1]), (at[0] + 30, at[1] + 15))
    assert len(mode.draft.handles) == 1
    assert pose.pixel_of(MIDDLE) == pytest.approx((at[0] + 30, at[1] + 15), abs=1.5)

    still = MIDDLE + 6
    seen = app.surface(1).vertices[still].copy()
    pose.click(still)
    assert len(mode.draft.handles) == 2
    # Where the user saw it, the first pull included.
    assert mode.goal(mode.draft.handles[1]) == pytest.approx(seen, abs=1e-4)


def test_exact_offsets_delete_and_the_list(pose) -> None:
    app, mode = pose.app, pose.app.mode
    plain = app.surface(1).vertices.copy()
    pose.click(MIDDLE)
    for axis, value in zip("xyz", (0.25, -0.125, 0.5), strict=True):
        app.handle(PanelInput(f"d{axis}", value))
    pose.wait()
    assert app.surface(1).vertices[MIDDLE] - plain[MIDDLE] == pytest.approx((0.25, -0.125, 0.5), abs=0.02)
    assert mode.draft.handles[0].offset == (0.25, -0.125, 0.5)
    pose.click(MIDDLE + 7)
    app.go_to_frame(3)
    app.handle(PanelInput("handle", 0))
    assert (app.play.frame, mode.selected) == (KEY, 0)
    app.handle(Key("delete"))
    pose.wait()
    assert [handle.vertex for handle in mode.draft.handles] == [MIDDLE + 7]


def test_a_pair_of_points_and_the_slider(pose) -> None:
    app, mode = pose.app, pose.app.mode
    a, b = MIDDLE - 4, MIDDLE + 4
    before = np.linalg.norm(np.subtract(*app.surface(1).vertices[[a, b]]))
    app.handle(PanelInput("tool:distance"))
    pose.click(a)
    assert "second" in mode.hint()
    pose.click(b)
    for value in (1.05, 1.1, 1.2):
        app.handle(PanelInput("factor", value, value == 1.2))
    pose.wait()
    after = np.linalg.norm(np.subtract(*app.surface(1).vertices[[a, b]]))
    assert after / before == pytest.approx(1.2, abs=0.02)
    app.handle(Key("z"))
    pose.wait()
    assert mode.draft.handles[0].factor == 1.0  # one step for the whole slide


def test_what_is_painted_stays_and_shift_lets_go(pose) -> None:
    app, mode = pose.app, pose.app.mode
    app.handle(PanelInput("tool:fix"))
    app.handle(PanelInput("brush", 12.0))
    held = MIDDLE + 9
    at = pose.pixel_of(held)
    pose.drag((at[0] - 60, at[1]), (at[0] + 60, at[1]))
    fixed = set(mode.draft.fixed)
    assert held in fixed
    assert 5 < len(fixed) < 400
    tint = mode.tint(1)
    assert tint is not None
    assert set(np.flatnonzero(tint[1])) == fixed

    app.handle(PanelInput("tool:move"))
    plain = app.surface(1).vertices.copy()
    at = pose.pixel_of(MIDDLE - 5)
    pose.drag(at, (at[0], at[1] + 25))
    apart = np.linalg.norm(app.surface(1).vertices - plain, axis=1)
    assert apart[sorted(fixed)].max() < 0.05 * apart.max()

    app.handle(PanelInput("tool:fix"))
    at = pose.pixel_of(held)
    pose.drag(at, at, modifiers=("shift",))
    assert held not in mode.draft.fixed
    app.handle(Key("z"))
    assert set(mode.draft.fixed) == fixed


def test_everything_farther_than_a_distance_is_held(pose) -> None:
    app, mode = pose.app, pose.app.mode
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    app.handle(PanelInput("beyond", True))
    app.handle(PanelInput("beyond_distance", 4.0))
    pose.wait()
    apart = np.linalg.norm(app.surface(1).vertices - app.surface_named("before").vertices, axis=1)
    rest = app.editing.session.rest
    far = np.linalg.norm(rest - rest[MIDDLE], axis=1) > 5.0
    assert apart[far].max() < 0.02 * apart.max()
    tint = mode.tint(1)
    assert tint is not None
    assert (tint[1][far] > 0).mean() > 0.9
    assert tint[1][MIDDLE] == 0


def test_the_window_lies_round_the_frame_and_follows_the_time_line(pose) -> None:
    app, mode = pose.app, pose.app.mode
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    assert mode.draft.parameters.window == (0, 39)  # a second either side, cut off at the take's ends
    app.handle(TimelineInput("first", 15))
    app.handle(TimelineInput("last", 25))
    app.handle(PanelInput("spread", "weights"))
    pose.wait()
    assert mode.draft.parameters.window == (15, 25)
    weights = app.editing.snapshot.edited_weights - app.editing.snapshot.weights
    assert np.abs(weights[15:26]).max() > 1e-3
    assert np.abs(np.delete(weights, np.s_[15:26], axis=0)).max() == 0
    app.handle(Command("window", None))
    assert mode.draft.parameters.window is None


def test_the_reach_of_a_pull_and_what_touches_are_settings(pose) -> None:
    app, mode = pose.app, pose.app.mode
    plain = app.surface(1).vertices.copy()
    pose.click(MIDDLE)
    app.handle(PanelInput("dz", 0.5))
    app.handle(PanelInput("settings", True))
    far = []
    for percent in (0.0, 2.0):
        app.handle(PanelInput("reach", percent))
        pose.wait()
        moved = np.linalg.norm(app.surface(1).vertices - plain, axis=1)
        far.append(np.median(moved) / moved[MIDDLE])
    assert far[1] < 0.5 * far[0]
    app.handle(PanelInput("contacts", False))
    assert (mode.draft.parameters.reach, mode.draft.parameters.contacts) == (0.02, 0.0)
    app.handle(PanelInput("contacts", True))
    assert mode.draft.parameters.contacts == EditParameters.contacts


def test_residuals_are_told_for_every_handle(pose) -> None:
    app, mode = pose.app, pose.app.mode
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    residual = mode.residual(0)
    assert residual.left < 0.05 * residual.asked
    (items,) = (row for row in app.rows() if getattr(row, "name", "") == "handle")
    assert f"vertex {MIDDLE}" in items.items[0]
    met = residual.left < 1e-4 * app.data.target_framing.height
    assert items.items[0].endswith(", met" if met else " left")
    assert app.solve_seconds is not None
    assert "last solve" in app.status_line()[0]


def test_the_source_and_the_face_beside_are_left_to_the_view(pose) -> None:
    app, mode = pose.app, pose.app.mode
    before = app.views[1]
    at = pose.pixel_of(MIDDLE, pane=0)
    pose.drag(at, (at[0] + 25, at[1]), pane=0)
    assert mode.draft is None
    assert app.views[1] != before
    turned = app.views[1]
    pose.drag((3.0, 3.0), (30.0, 3.0))
    assert mode.draft is None
    assert app.views[1] != turned


def test_marks_stand_where_the_point_is_and_go(pose) -> None:
    app, mode = pose.app, pose.app.mode
    at = pose.pixel_of(MIDDLE)
    pose.drag(at, (at[0] + 25, at[1]))
    (disc,) = (mark for mark in mode.marks(1) if isinstance(mark, Disc) and mark.text == "1")
    assert disc.position == pytest.approx(app.surface(1).vertices[MIDDLE], abs=0.05)
    assert list(mode.marks(0)) == []
    assert list(mode.key_frames()) == [KEY]
    app.go_to_frame(KEY + 1)
    assert list(mode.marks(1)) == []


def test_a_draft_goes_through_its_data_and_keeps_what_has_no_gesture() -> None:
    others = (FixedConstraint((3, 4), frames=(7,)), BeyondConstraint(2.0, (1,)), FixedConstraint((9,), weight=2.0))
    draft = PoseDraft(
        (PointConstraint(3, 5, place=(1.0, 2.0, 3.0)), DistanceConstraint(4, (1, 2), factor=1.5)),
        (7, 8),
        0.25,
        others,
        EditParameters(window=(2, 9), mode="bases"),
        "a word",
        12,
    )
    plain = json.loads(json.dumps(draft.to_data()))
    assert PoseDraft.from_data(plain) == draft
    assert set(draft.data()) == {"constraints", "parameters", "note"}
    assert PoseDraft.from_data(json.loads(json.dumps(draft.data())), 12) == draft


def test_the_wheel_zooms_to_what_the_pointer_is_over(hand) -> None:
    app = hand.app
    at = hand.pixel_of(MIDDLE + 40)
    event = hand.event("wheel", *at, wheel=6.0)
    middle = np.asarray(app.framing_camera(1).target)
    toward = app.framing_camera(1).axes()[2]
    origin, direction = np.asarray(event.origin), np.asarray(event.direction)
    under = origin + (middle - origin) @ toward / (direction @ toward) * direction
    app.handle(event)
    assert app.views[1].distance < 2
    assert hand.pixel(under) == pytest.approx(at, abs=0.1)


def test_the_brushes_ring_lies_on_the_face_and_does_not_fall_off_it(pose) -> None:
    app = pose.app
    app.handle(PanelInput("tool:fix"))
    app.handle(PanelInput("brush", 8.0))
    camera, picker = app.framing_camera(1), app.picker(1)
    for vertex in (MIDDLE, 11 * 31 + 30):  # in the middle, and on the border
        pose.send("hover", *pose.pixel_of(vertex))
        (ring,) = app.mode.marks(1)
        middle = app.surface(1).vertices[vertex]
        away = np.linalg.norm(ring.points - middle, axis=1)
        radius = 0.08 * app.data.target_framing.height
        assert away.max() < 2.1 * radius
        assert away.min() > 0.4 * radius
        again = picker.draped(camera.position, ring.points, radius)
        assert again == pytest.approx(ring.points, abs=1e-3 * radius)
