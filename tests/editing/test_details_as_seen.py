"""Edits of wrinkles are about the wrinkles that the result shows, in either reconstruction of them."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.detail_edit import DetailEdit, GainEdit, PasteEdit, Region, ScaleEdit
from toolkit.editing import EditSession
from toolkit.mesh.geometry import local_frames

KEY = 7
COATING = '[details]\nmethod = "coating"\n'
BLOCK = (np.arange(8, 16)[:, None] * 31 + np.arange(10, 20)).ravel()


def frames_at(session: EditSession, t: int) -> tuple[np.ndarray, np.ndarray]:
    """The smoothed surface of a frame in the pose of the bases, (V, 3), and its local frames, (V, 3, 3)."""
    opened, everything = session._stack.opened, np.arange(session.n_vertices)
    smooth = opened.target.rest.smooth + opened.take.displacements_at(t, everything)
    return smooth, local_frames(smooth, session.triangles, opened.target.rest.neighbour)


def seen(session: EditSession) -> np.ndarray:
    """Motion details of the key frame as the result shows them: what is left of it without its own relief, (V, 3)."""
    smooth, frames = frames_at(session, KEY)
    own = np.einsum("vij,vj->vi", frames, session._stack.opened.target.rest.detail)
    return session._stack.opened.placement.back(KEY, session.frame(KEY)) - smooth - own


@pytest.mark.parametrize("extra", ["", COATING], ids=["displacement", "coating"])
@pytest.mark.parametrize("factor", [0.0, 2.0, -1.0])
def test_a_factor_is_that_of_the_wrinkles_in_sight_and_of_no_others(make, extra: str, factor: float) -> None:
    session = EditSession.open(make(extra))
    before, frame = seen(session), session.frame(KEY)
    change = session.draft_detail(ScaleEdit(region=Region.whole(BLOCK), frame=KEY, factor=factor, window=(2, 13)))
    after, edited = seen(session), session.frame(KEY)
    size = np.linalg.norm(before[BLOCK])
    assert size > 1e-3 * np.linalg.norm(np.ptp(session.rest, axis=0))
    assert np.linalg.norm(after[BLOCK] - factor * before[BLOCK]) < 0.01 * size
    beyond = np.setdiff1d(np.arange(session.n_vertices), change.vertices)
    assert len(beyond) > 100
    assert np.array_equal(edited[beyond], frame[beyond])


def test_a_wrinkle_stays_on_its_skin_while_the_face_moves(make) -> None:
    session = EditSession.open(make())
    surface = session.detail_take.surface
    start, goal = (surface.at_vertex(v) for v in (12 * 31 + 15, 16 * 31 + 11))
    paste = PasteEdit(
        region=Region.whole(BLOCK), frame=KEY, start=start, goal=goal, hold=True, add=True, window=(1, 38)
    )
    change = session.draft_detail(paste)
    back, local = session._stack.opened.placement.back, {}
    for t in (KEY, 16, 24):
        moved = back(t, session.frame(t)) - back(t, session.unedited_frame(t))
        _, frames = frames_at(session, t)
        local[t] = np.einsum("vji,vj->vi", frames, moved) / change.activation[t - 1]
    turned = np.einsum("vij,vik->vjk", frames_at(session, KEY)[1], frames_at(session, 24)[1])[change.vertices]
    assert np.degrees(np.arccos((np.trace(turned, axis1=1, axis2=2).min() - 1) / 2)) > 5  # the face does move
    size = np.linalg.norm(local[KEY])
    for t in (16, 24):
        assert np.linalg.norm(local[t] - local[KEY]) < 1e-3 * size


@pytest.mark.parametrize("extra", ["", COATING], ids=["displacement", "coating"])
@pytest.mark.parametrize(
    "nothing",
    [
        ScaleEdit(region=Region.whole(BLOCK), frame=KEY, factor=1.0, window=(2, 13)),
        GainEdit(gains=((0, 1.0),)),
        GainEdit(gains=((0, 1.0),), details="static"),
    ],
    ids=["factor", "gain", "static"],
)
def test_an_edit_that_asks_for_nothing_changes_nothing(make, extra: str, nothing: DetailEdit) -> None:
    session = EditSession.open(make(extra))
    session.draft_detail(nothing)
    for t in (20, KEY):
        assert np.array_equal(session.frame(t), session.unedited_frame(t))
