"""Edits of wrinkles are about the wrinkles that the result shows, in either reconstruction of them."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.detail_edit import DetailEdit, GainEdit, Region, ScaleEdit
from toolkit.editing import EditSession
from toolkit.mesh.geometry import local_frames

KEY = 7
COATING = '[details]\nmethod = "coating"\n'
BLOCK = (np.arange(8, 16)[:, None] * 31 + np.arange(10, 20)).ravel()


def seen(session: EditSession) -> np.ndarray:
    """Motion details of the key frame as the result shows them: what is left of it without its own relief, (V, 3)."""
    opened, everything = session._stack.opened, np.arange(session.n_vertices)
    rest = opened.target.rest
    smooth = rest.smooth + opened.take.displacements_at(KEY, everything)
    own = np.einsum("vij,vj->vi", local_frames(smooth, session.triangles, rest.neighbour), rest.detail)
    return opened.placement.back(KEY, session.frame(KEY)) - smooth - own


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
