from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from toolkit.detail_edit import Curve, Region, SurfacePoint
from toolkit.shot import Shot
from toolkit.shot.journal import Journal
from viewer.modes.detail.draft import DetailDraft
from viewer.modes.detail.handles import PasteRing
from viewer.state.events import Key, PanelInput, TimelineInput
from viewer.state.marks import Disc

KEY = 6
"""The ripple along y = 0 is at its highest."""
MIDDLE = 11 * 31 + 15


@pytest.fixture
def detail(hand):
    """The hand of a user in the detail edit mode, at the key frame."""
    hand.app.choose_mode("detail")
    hand.app.go_to_frame(KEY)
    hand.wait()
    return hand


def edits(shot: Shot) -> tuple:
    return Journal(shot.edits_path).replay().edits


def painted(detail, size: float = 8.0) -> None:
    """Paint over the middle of the ripple."""
    detail.app.handle(PanelInput("brush", size))
    x, y = detail.pixel_of(MIDDLE)
    detail.drag((x - 50, y), (x + 50, y))


def moved(app) -> np.ndarray:
    return np.linalg.norm(app.surface_named("result").vertices - app.surface_named("before").vertices, axis=1)


def test_paint_a_wrinkle_away_and_find_it_in_the_journal(detail, shot: Shot) -> None:
    app, mode = detail.app, detail.app.mode
    app.handle(PanelInput("remove"))
    painted(detail)
    region = mode.draft.region
    assert MIDDLE in region.vertices
    assert 0 < region.weights.min() < 1  # a soft border
    apart = moved(app)
    assert apart[region.vertices].max() > 0
    far = np.setdiff1d(np.arange(len(apart)), mode.change.vertices)
    assert apart[far].max() == 0
    assert app.play.window == mode.change.window
    app.handle(Key("enter"))
    detail.wait()
    (edit,) = edits(shot)
    assert (edit.kind, edit.data["kind"], edit.data["factor"], edit.data["frame"]) == ("detail", "scale", 0.0, KEY)
    assert edit.data["region"]["vertices"] == region.vertices.tolist()
    assert mode.draft is None
    assert np.array_equal(moved(app), apart)
    app.handle(Key("z"))
    detail.wait()
    assert moved(app).max() == 0


def test_shift_erases_and_undo_brings_the_stroke_back(detail) -> None:
    app, mode = detail.app, detail.app.mode
    painted(detail)
    first = mode.draft
    at = detail.pixel_of(MIDDLE)
    detail.drag(at, at, modifiers=("shift",))
    assert MIDDLE not in mode.draft.region.vertices
    app.handle(Key("z"))
    detail.wait()
    assert mode.draft is first or mode.draft == first
    app.handle(Key("z"))
    detail.wait()
    assert mode.draft is None


def test_a_line_selects_what_lies_along_it_and_the_width_follows(detail) -> None:
    app, mode = detail.app, detail.app.mode
    app.handle(PanelInput("tool:line"))
    ends = [MIDDLE - 5 * 31, MIDDLE + 5 * 31]
    for vertex in ends:
        detail.click(vertex)
    draft = mode.draft
    assert len(draft.line) == 2
    assert len(draft.curve) > 5
    assert set(ends) <= set(draft.region.vertices.tolist())
    narrow = len(draft.region)
    app.handle(PanelInput("width", 10.0))
    detail.wait()
    assert len(mode.draft.region) > 2 * narrow
    app.handle(Key("z"))
    detail.wait()
    app.handle(Key("delete"))
    detail.wait()
    assert len(mode.draft.line) == 1
    assert mode.draft.curve is None


def test_a_line_drawn_in_one_go_runs_where_the_hand_went(detail) -> None:
    app, mode = detail.app, detail.app.mode
    app.handle(PanelInput("tool:line"))
    x, y = detail.pixel_of(MIDDLE)
    detail.drag((x - 80, y), (x + 80, y + 30), steps=12)
    draft = mode.draft
    assert 3 <= len(draft.line) <= 10
    ground = mode.grounds.ground
    line = ground.surface.places(draft.curve)
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert steps.sum() < 1.3 * np.linalg.norm(line[-1] - line[0])
    assert len(mode.stroke_places) == 0


def test_the_region_grows_shrinks_and_is_mirrored(detail) -> None:
    app, mode = detail.app, detail.app.mode
    x, y = detail.pixel_of(MIDDLE)
    app.handle(PanelInput("brush", 6.0))
    detail.drag((x + 90, y - 90), (x + 100, y - 90))
    region = mode.draft.region
    app.handle(PanelInput("grow"))
    detail.wait()
    grown = mode.draft.region
    assert set(region.vertices) < set(grown.vertices)
    app.handle(PanelInput("shrink"))
    detail.wait()
    assert len(mode.draft.region) < len(grown)
    app.handle(PanelInput("mirror_region"))
    detail.wait()
    rest = app.editing.session.rest - app.editing.session.rest.mean(axis=0)
    here, there = (rest[one.vertices, :2].mean(axis=0) for one in (region, mode.draft.region))
    # The patch is as good as symmetric both ways: one of them was taken.
    flipped = np.sign(here) != np.sign(there)
    assert flipped.sum() == 1
    assert np.abs(there) == pytest.approx(np.abs(here), abs=0.8)


def test_regions_are_saved_and_found_again(detail, shot: Shot, opened) -> None:
    app, mode = detail.app, detail.app.mode
    painted(detail)
    region = mode.draft.region
    app.handle(PanelInput("save_region"))
    assert "no name" in app.status_line()[0]
    app.handle(PanelInput("region_name", "the bridge"))
    app.handle(PanelInput("save_region"))
    app.handle(PanelInput("clear"))
    assert mode.draft.region is None
    other = opened(Shot(shot.path))
    other.app.choose_mode("detail")
    other.app.handle(PanelInput("load_region", "the bridge"))
    found = other.app.mode.draft.region
    assert np.array_equal(found.vertices, region.vertices)
    assert np.allclose(found.weights, region.weights)


def test_the_factor_enhances_and_turns_over(detail) -> None:
    app, mode = detail.app, detail.app.mode
    painted(detail)
    vertex = int(mode.draft.region.vertices[np.argmax(moved_after(detail, 2.0)[mode.draft.region.vertices])])
    before = app.surface_named("before").vertices[vertex]
    double = app.surface(1).vertices[vertex] - before
    moved_after(detail, -1.0)
    over = app.surface(1).vertices[vertex] - before
    assert over == pytest.approx(-2 * double, rel=0.01, abs=1e-4)
    assert len(mode._undo) == 3  # painting and two slides


def moved_after(detail, factor: float) -> np.ndarray:
    for share in (0.5, 1.0):
        detail.app.handle(PanelInput("factor", 1 + share * (factor - 1), share == 1.0))
    detail.wait()
    return moved(detail.app)


def test_a_copy_is_placed_by_the_pointer_and_turned_by_the_knob(detail) -> None:
    app, mode = detail.app, detail.app.mode
    painted(detail, 5.0)
    app.handle(PanelInput("action", "paste"))
    assert mode.tool == "place"
    assert mode.draft.start is not None
    assert "point to where" in mode.draft.missing
    goal = 11 * 31 + 24
    at = detail.pixel_of(MIDDLE)
    detail.drag(at, detail.pixel_of(goal))
    point = mode.draft.goal
    assert goal in app.surface(1).triangles[point.triangle]
    assert mode.draft.missing == ""
    apart = moved(app)
    assert np.argmax(apart) in mode.change.region.vertices
    rest = app.editing.session.rest
    assert np.linalg.norm(rest[np.argmax(apart)] - rest[goal]) < 4

    ring = mode.ring(1)
    detail.drag(detail.pixel(ring.knob(0, 1)), detail.pixel(ring.knob(70, 1.4)))
    assert mode.draft.rotation == pytest.approx(70, abs=3)
    assert mode.draft.scale == pytest.approx(1.4, abs=0.05)
    discs = [mark for mark in mode.marks(1) if isinstance(mark, Disc)]
    assert {"from", "to"} <= {disc.text for disc in discs}
    app.handle(PanelInput("mirror", True))
    app.handle(PanelInput("commit"))
    detail.wait()
    data = app.editing.edits[0].data
    assert data["kind"] == "paste"
    assert data["mirror"] is True
    assert data["rotation"] == pytest.approx(70, abs=3)


def test_a_wrinkle_is_bent_along_a_drawn_line(detail) -> None:
    app, mode = detail.app, detail.app.mode
    app.handle(PanelInput("action", "reshape"))
    assert mode.tool == "line"
    x, y = detail.pixel_of(MIDDLE)
    detail.drag((x - 60, y), (x + 60, y), steps=10)
    assert "that it is to follow" in mode.draft.missing
    app.handle(PanelInput("tool:goal"))
    detail.drag((x - 60, y - 20), (x + 60, y + 10), steps=10)
    assert mode.draft.missing == ""
    assert mode.draft.goal_curve is not None
    assert moved(app).max() > 0
    app.handle(Key("enter"))
    detail.wait()
    assert app.editing.edits[0].data["kind"] == "reshape"


def test_gains_over_the_take_begin_with_the_slider(detail) -> None:
    app, mode = detail.app, detail.app.mode
    app.handle(PanelInput("action", "gain"))
    app.handle(PanelInput("everywhere", True))
    app.handle(PanelInput("gain", 0.0))
    detail.wait()
    assert mode.draft.gains == ((KEY, 0.0),)
    assert (moved(app) > 0).mean() > 0.9
    app.go_to_frame(30)
    app.handle(PanelInput("add_key"))
    app.handle(PanelInput("gain", 2.0))
    detail.wait()
    assert mode.draft.gains == ((KEY, 0.0), (30, 2.0))
    app.handle(PanelInput("key", 0))
    assert app.play.frame == KEY
    app.handle(PanelInput("delete_key"))
    assert mode.draft.gains == ((30, 2.0),)


def test_the_window_is_found_shown_and_can_be_dragged(detail) -> None:
    app, mode = detail.app, detail.app.mode
    app.handle(PanelInput("factor", 2.0))
    painted(detail)
    found = mode.change.window
    assert app.timeline().window == found
    assert found[0] <= KEY <= found[1]
    app.handle(PanelInput("threshold", 0.8))
    detail.wait()
    assert found[1] - found[0] > np.ptp(mode.change.window) > 0
    app.handle(TimelineInput("last", found[1] + 4, "drag"))
    app.handle(TimelineInput("last", found[1] + 5))
    detail.wait()
    assert mode.draft.window == mode.change.window
    assert mode.draft.window[1] == found[1] + 5
    app.handle(Key("z"))
    assert mode.draft.window is None  # one step for the whole drag
    app.handle(PanelInput("details", "static"))
    detail.wait()
    assert mode.change.static_scale is not None


def test_an_open_edit_outlives_a_kill_and_a_committed_one_is_opened_again(detail, shot: Shot, opened) -> None:
    app, mode = detail.app, detail.app.mode
    app.handle(PanelInput("factor", 2.0))
    painted(detail)
    region = mode.draft.region
    other = opened(Shot(shot.path))
    kept = other.app.modes["detail"].draft
    assert np.array_equal(kept.region.vertices, region.vertices)
    other.app.choose_mode("detail")
    other.app.handle(Key("enter"))
    other.wait()
    number = edits(shot)[0].number
    other.app.mode.open(other.app.editing.edits[0])
    other.app.mode.enter()
    other.app.handle(PanelInput("factor", 3.0))
    other.app.handle(PanelInput("note", "more"))
    other.wait()
    other.app.handle(PanelInput("commit"))
    other.wait()
    (edit,) = edits(shot)
    assert (edit.number, edit.data["factor"], edit.data["note"]) == (number, 3.0, "more")


def test_what_is_missing_is_said_and_nothing_is_committed(detail, shot: Shot) -> None:
    app = detail.app
    app.handle(Key("enter"))
    assert "nothing to commit" in app.status_line()[0]
    app.handle(PanelInput("action", "paste"))
    at = detail.pixel_of(MIDDLE)
    app.mode.choose_tool("place")
    detail.drag(at, at)
    assert "paint the wrinkle first" in app.status_line()[0]
    assert edits(shot) == ()


def test_the_rings_angle_counts_counter_clockwise_from_outside(detail) -> None:
    app = detail.app
    ring = PasteRing.at(app, 1, SurfacePoint(600, (0.3, 0.3, 0.4)), 2.0)
    right, above, toward = app.framing_camera(1).axes()
    assert ring.normal @ toward > 0.5
    assert (ring.knob(0, 1) - ring.middle) @ above > 1.5
    assert (ring.knob(90, 1) - ring.middle) @ right < -1.5


def test_a_draft_goes_through_its_data() -> None:
    line = (SurfacePoint(3, (0.2, 0.3, 0.5)), SurfacePoint(4, (1.0, 0.0, 0.0)))
    curve = Curve(np.array([3, 4]), np.array([[0.2, 0.3, 0.5], [1.0, 0.0, 0.0]]))
    draft = DetailDraft(
        frame=7,
        action="paste",
        region=Region(np.array([1, 5]), np.array([0.5, 1.0])),
        line=line,
        curve=curve,
        start=line[0],
        goal=line[1],
        gains=((3, 0.5),),
        window=(2, 9),
        mirror=True,
        note="a word",
        instead_of=4,
    )
    again = DetailDraft.from_data(json.loads(json.dumps(draft.to_data())))
    assert np.array_equal(again.region.vertices, [1, 5])
    assert np.array_equal(again.curve.weights, curve.weights)
    assert replace(again, region=None, curve=None) == replace(draft, region=None, curve=None)
    from_journal = DetailDraft.from_data(json.loads(json.dumps(draft.data())), 4)
    assert from_journal.data() == draft.data()
    assert (from_journal.note, from_journal.instead_of, from_journal.mirror) == ("a word", 4, True)
