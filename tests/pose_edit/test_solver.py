from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.pose_edit import (
    DistanceConstraint,
    EditableTake,
    EditParameters,
    FixedConstraint,
    PointConstraint,
    PoseEditor,
)

KEY, TWIN = 18, 51  # frames of a similar expression in `face`


def vertex_near(take: EditableTake, x: float, y: float) -> int:
    return int(np.argmin(((take.rest[:, :2] - [x, y]) ** 2).sum(axis=1)))


def corner_pull(take: EditableTake) -> PointConstraint:
    """Against the main expression of the key frame."""
    return PointConstraint(KEY, vertex_near(take, 0.3, -0.6), offset=(0.0, -0.03, -0.1))


def motion(edited: EditableTake, take: EditableTake, frame: int) -> np.ndarray:
    return np.sqrt(((edited.smooth_frame(frame) - take.smooth_frame(frame)) ** 2).sum(axis=1))


def test_without_constraints_nothing_changes(bump: TriangleMesh, face: EditableTake) -> None:
    editor = PoseEditor(face, bump.triangles)
    for constraints in ([], [FixedConstraint((1, 2, 3))]):
        edit = editor.solve(constraints)
        assert edit.weights.tobytes() == face.weights.tobytes()
        assert edit.moves is None
        assert edit.bases().tobytes() == (face.moves + face.rest).tobytes()
        assert edit.smooth_frame(KEY).tobytes() == face.smooth_frame(KEY).tobytes()


def test_without_bases_there_is_nothing_to_edit_by(bump: TriangleMesh, face: EditableTake) -> None:
    still = replace(face, moves=face.moves[:0], weights=face.weights[:, :0])
    assert np.array_equal(still.smooth_frame(3), bump.vertices)
    with pytest.raises(InputError, match="no bases"):
        PoseEditor(still, bump.triangles).solve([corner_pull(face)])


def test_bases_reach_similar_expressions_and_weights_stay_in_the_window(bump: TriangleMesh, face: EditableTake) -> None:
    """The paper's Figure 4."""
    editor, pull = PoseEditor(face, bump.triangles), corner_pull(face)
    moved = {}
    for mode in ("bases", "weights", "both"):
        edit = editor.solve([pull], EditParameters(mode=mode, window=(8, 28)))
        moved[mode] = motion(edit.take, face, KEY).max(), motion(edit.take, face, TWIN).max()
        if mode == "weights":
            assert edit.moves is None
            outside = [t for t in range(face.n_frames) if not 8 <= t <= 28]
            assert edit.weights[outside].tobytes() == face.weights[outside].tobytes()
        assert (edit.weights >= 0).all()
    asked = float(np.linalg.norm(pull.offset))
    assert moved["bases"][0] == pytest.approx(asked, rel=0.02)
    assert moved["bases"][1] > 0.8 * moved["bases"][0]
    assert moved["weights"][0] > 0.5 * asked
    assert moved["weights"][1] == 0
    assert 0.1 * asked < moved["both"][1] < moved["bases"][1]


@pytest.mark.parametrize("window", [(8, 28), (0, 28), (18, 18)])
def test_window_ends_join_without_a_jump(bump: TriangleMesh, face: EditableTake, window: tuple[int, int]) -> None:
    parameters = EditParameters(mode="weights", window=window)
    edit = PoseEditor(face, bump.triangles).solve([corner_pull(face)], parameters)
    change = np.abs(edit.weights - face.weights).sum(axis=1)
    first, last = window
    assert change[:first].max(initial=0) == 0 == change[last + 1 :].max(initial=0)
    if first != last:
        # Speed begins small beside the mean slope to the edited frame: a hat would begin with all of it.
        for joint in [last] if first == 0 else [first, last]:
            assert 0 < change[joint] < 0.5 * change.max() / abs(KEY - joint)


def test_without_smoothness_speed_jumps_where_the_window_ends(bump: TriangleMesh, face: EditableTake) -> None:
    editor, pull = PoseEditor(face, bump.triangles), corner_pull(face)
    at_end = []
    for smoothness in (0.0, 5.0):
        parameters = EditParameters(mode="weights", window=(8, 28), smoothness=smoothness)
        change = editor.solve([pull], parameters).weights - face.weights
        at_end.append(np.abs(change[8]).max() / np.abs(change).max())
    assert at_end[0] > 1.7 * at_end[1]


@pytest.mark.parametrize("mode", ["both", "bases", "weights"])
def test_what_is_fixed_stays(bump: TriangleMesh, face: EditableTake, mode: str) -> None:
    """A mouth edit with the rest fixed leaves the forehead."""
    forehead = np.flatnonzero(face.rest[:, 1] > 0.2)
    mouth = PointConstraint(KEY, vertex_near(face, 0.0, -0.8), offset=(0.05, -0.05, 0.08))
    brow = PointConstraint(KEY, vertex_near(face, 0.1, -0.1), offset=(0.0, 0.1, 0.05))
    fixed = FixedConstraint(tuple(forehead.tolist()))
    parameters = EditParameters(mode=mode, window=(8, 28))
    edit = PoseEditor(face, bump.triangles).solve([mouth, brow, fixed], parameters)
    free = PoseEditor(face, bump.triangles).solve([mouth, brow], parameters)
    for frame in range(face.n_frames):
        assert motion(edit.take, face, frame)[forehead].max() < 0.01 * motion(edit.take, face, KEY).max()
    if mode != "weights":
        assert motion(free.take, face, KEY)[forehead].max() > 0.1 * motion(free.take, face, KEY).max()
        assert edit.residuals[0].left < 0.02 * edit.residuals[0].asked


def test_fixed_in_one_frame_only(bump: TriangleMesh, face: EditableTake) -> None:
    pull = corner_pull(face)
    beside = vertex_near(face, 0.15, -0.6)
    editor = PoseEditor(face, bump.triangles)
    plain = editor.solve([pull], EditParameters(mode="bases"))
    fixed = editor.solve([pull, FixedConstraint((beside,), frames=(KEY,))], EditParameters(mode="bases"))
    assert motion(fixed.take, face, KEY)[beside] < 0.05 * motion(plain.take, face, KEY)[beside]
    with pytest.raises(InputError, match="too many"):
        FixedConstraint(tuple(range(1000)), frames=(KEY,))


def test_constraints_are_about_the_visible_surface(bump: TriangleMesh, face: EditableTake) -> None:
    rng = np.random.default_rng(2)
    details = 0.02 * rng.normal(size=(face.n_frames, face.n_vertices, 3))
    seen = replace(face, detail_offset=lambda frame, ids, shape_at: details[frame, ids])
    a, b = vertex_near(face, 0.3, -0.6), vertex_near(face, -0.4, -0.5)
    before = face.smooth_frame(KEY) + details[KEY]
    place = before[a] + [0.02, 0.03, -0.05]
    wanted = [PointConstraint(KEY, a, place=tuple(place)), DistanceConstraint(40, (a, b), factor=1.2)]
    edit = PoseEditor(seen, bump.triangles).solve(wanted, EditParameters(lambda_e=1e6))
    assert np.abs(edit.smooth_frame(KEY)[a] + details[KEY, a] - place).max() < 1e-4
    (old, new) = (x[a] - x[b] for x in (face.smooth_frame(40) + details[40], edit.smooth_frame(40) + details[40]))
    assert np.abs(new - 1.2 * old).max() < 1e-4


def test_a_handle_takes_the_spike_off(bump: TriangleMesh, face: EditableTake) -> None:
    v = vertex_near(face, 0.0, -0.3)
    ring = np.setdiff1d(bump.triangles[(bump.triangles == v).any(axis=1)], v)
    pull = PointConstraint(KEY, v, offset=(0.0, 0.0, 0.1))
    near = PointConstraint(KEY, int(ring[0]), offset=(0.0, 0.0, 0.1))
    follows = []
    for handle in (0.0, 0.08):
        parameters = EditParameters(mode="bases", handle=handle, reach=0)
        editor = PoseEditor(face, bump.triangles)
        edit = editor.solve([pull], parameters)
        assert edit.residuals[0].left < 0.01 * edit.residuals[0].asked
        moved = edit.smooth_frame(KEY) - face.smooth_frame(KEY)
        follows.append(moved[ring, 2].min() / moved[v, 2])
        # The energy told is that of the edited bases, whatever they were sought among.
        delta = edit.moves.of_bases()
        bent = sum(float(np.sum(d * (editor.matrix(parameters) @ d))) for d in delta)
        left = parameters.lambda_e / editor._edge**2 * edit.residuals[0].left ** 2
        assert edit.energies[-1] == pytest.approx(bent + left, rel=1e-6)
        both = editor.solve([pull, near], parameters)
        assert max(residual.left for residual in both.residuals) < 0.01 * 0.1
    assert follows[1] > 0.9 > follows[0]
    assert 1 - follows[1] < 0.5 * (1 - follows[0])


def test_a_reach_keeps_a_pull_from_taking_the_whole_face_along(bump: TriangleMesh, face: EditableTake) -> None:
    pull = PointConstraint(KEY, vertex_near(face, 0.6, 0.6), offset=(0.0, 0.0, 0.1))
    away = np.sqrt(((face.rest - face.rest[pull.vertex]) ** 2).sum(axis=1))
    far = []
    for reach in (0.0, 0.1, 0.05):
        edit = PoseEditor(face, bump.triangles).solve([pull], EditParameters(mode="bases", reach=reach))
        moved = motion(edit.take, face, KEY)
        assert moved[pull.vertex] == pytest.approx(0.1, rel=0.01)
        far.append(float(np.median(moved[away > 1.2])))
    assert far[0] > 0.02
    assert far[1] < 0.1 * far[0]
    assert far[2] < 0.1 * far[1]


def test_contradictions_are_told_by_their_residuals(bump: TriangleMesh, face: EditableTake) -> None:
    v = vertex_near(face, 0.3, -0.6)
    there, here = (PointConstraint(KEY, v, offset=(0.0, 0.0, z)) for z in (0.1, -0.1))
    elsewhere = PointConstraint(KEY, vertex_near(face, -0.4, -0.5), offset=(0.0, 0.02, 0.0))
    edit = PoseEditor(face, bump.triangles).solve([there, here, elsewhere])
    left = [residual.left for residual in edit.residuals]
    assert left[0] == pytest.approx(0.1, rel=0.05)
    assert left[1] == pytest.approx(0.1, rel=0.05)
    assert left[2] < 1e-3
    assert edit.residuals[0].asked == pytest.approx(0.1)
    assert edit.residuals[0].constraint is there


def test_dragging_starts_from_the_last_solution_and_commits_the_same(bump: TriangleMesh, face: EditableTake) -> None:
    editor, pull = PoseEditor(face, bump.triangles), corner_pull(face)
    parameters = EditParameters(window=(8, 28), lambda_w=0.1)
    cold = PoseEditor(face, bump.triangles).solve([pull], parameters)
    for share in (0.2, 0.5, 0.8, 0.99):
        editor.solve([replace(pull, offset=tuple(share * np.array(pull.offset)))], parameters, warm=True)
    warm = editor.solve([pull], parameters, warm=True)
    assert warm.rounds <= cold.rounds
    assert warm.energies[-1] == pytest.approx(cold.energies[-1], rel=0.01)
    again = editor.solve([pull], parameters)
    assert again.weights.tobytes() == cold.weights.tobytes()
    assert again.smooth_frame(KEY).tobytes() == cold.smooth_frame(KEY).tobytes()


def test_a_cancel_leaves_what_was(bump: TriangleMesh, face: EditableTake) -> None:
    editor, pull = PoseEditor(face, bump.triangles), corner_pull(face)
    parameters = EditParameters(lambda_w=0.1)
    before = editor.solve([pull], parameters)

    def cancel(what: str, done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        editor.solve([replace(pull, offset=(1.0, 0.0, 0.0))], parameters, progress=cancel)
    warm = editor.solve([pull], parameters, warm=True)
    assert warm.energies[0] == pytest.approx(before.energies[-1], rel=1e-9)


def test_edits_stack(bump: TriangleMesh, face: EditableTake) -> None:
    first = PoseEditor(face, bump.triangles).solve([corner_pull(face)], EditParameters(window=(8, 28)))
    other = PointConstraint(40, vertex_near(face, 0.0, 0.7), offset=(0.0, 0.0, 0.1))
    second = PoseEditor(first.take, bump.triangles).solve([other], EditParameters(mode="bases"))
    assert len(second.take.edits) == 2
    assert second.residuals[0].left < 0.01 * second.residuals[0].asked
    ids = np.array([3, 100, 400])
    assert np.allclose(second.take.moves_at(ids), (second.bases() - face.rest)[:, ids], atol=1e-12)
    full = face.rest + np.einsum("k,kvc->vc", second.weights[40], second.bases() - face.rest)
    assert np.allclose(second.smooth_frame(40), full, atol=1e-12)


def test_bad_input_is_refused(bump: TriangleMesh, face: EditableTake) -> None:
    editor = PoseEditor(face, bump.triangles)
    with pytest.raises(InputError, match="no frame 60"):
        editor.solve([PointConstraint(60, 0, offset=(0, 0, 0))])
    with pytest.raises(InputError, match="no vertex -1"):
        editor.solve([PointConstraint(0, -1, offset=(0, 0, 0))])
    with pytest.raises(InputError, match="outside the window"):
        editor.solve([PointConstraint(5, 1, offset=(0, 0, 0))], EditParameters(mode="weights", window=(8, 28)))
    with pytest.raises(InputError, match="does not lie in the take"):
        editor.solve([PointConstraint(5, 1, offset=(0, 0, 0))], EditParameters(window=(8, 60)))
    twice = [PointConstraint(KEY, 3, offset=(0, 0, z), weight=1e17) for z in (0.1, 0.2)]
    with pytest.raises(InputError, match="weigh so much"):
        editor.solve(twice)
    with pytest.raises(InputError, match="either a place or an offset"):
        PointConstraint(0, 1)
    with pytest.raises(InputError, match="no place"):
        PointConstraint(0, 1, place=(0.0, float("nan"), 0.0))
    with pytest.raises(InputError, match="either a length or a factor"):
        DistanceConstraint(0, (1, 2), length=1.0, factor=2.0)
    with pytest.raises(InputError, match="cannot be had"):
        DistanceConstraint(0, (1, 1), length=1.0)
    with pytest.raises(InputError, match="mode cannot be 'loose'"):
        EditParameters(mode="loose")
    with pytest.raises(InputError, match="must be positive"):
        EditParameters(lambda_w=0)
