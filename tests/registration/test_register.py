"""Registration against known answers on a synthetic face, its equivariance, and its refusals."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolkit.errors import InputError, RegistrationError
from toolkit.mesh import TriangleMesh, face_normals
from toolkit.registration import Landmarks, Registration, RegistrationParameters, register


@pytest.fixture(scope="module")
def registered(pair) -> Registration:
    return register(pair.source.mesh, pair.target.mesh, pair.landmarks, pair.lines)


def test_another_topology_is_met(pair, registered: Registration) -> None:
    skin, size = ~pair.source.bag, pair.target.mesh.diagonal
    error = np.linalg.norm(registered.vertices - pair.truth, axis=1) / size
    assert error[skin].mean() < 0.004
    assert np.percentile(error[skin], 99) < 0.02
    assert np.percentile(registered.distance[skin], 90) < 1e-4 * size  # the borders differ
    np.testing.assert_array_equal(registered.interior, pair.source.bag)


def test_lips_keep_their_side_and_nothing_folds(pair, registered: Registration) -> None:
    assert registered.quality.wrong_sheet_share == 0
    assert registered.quality.flipped_share < 0.002
    triangles = pair.source.mesh.triangles
    agree = np.einsum("fd,fd->f", face_normals(registered.vertices, triangles), face_normals(pair.truth, triangles))
    whole = (~pair.source.bag)[triangles].all(axis=1)
    assert np.mean(agree[whole] < 0) < 0.002


def test_the_rim_is_as_smooth_as_the_true_one(pair, registered: Registration) -> None:
    def roughness(points: np.ndarray) -> float:
        bend = np.diff(points, n=2, axis=0)
        return float(np.sqrt(np.mean(np.sum(bend**2, axis=1))))

    for rim in (pair.source.upper, pair.source.lower):
        assert roughness(registered.vertices[rim]) < 1.5 * roughness(pair.truth[rim]) + 1e-4
        gap = np.linalg.norm(registered.vertices[rim] - pair.truth[rim], axis=1)
        assert gap.max() < 0.02 * pair.target.mesh.diagonal


def test_the_bag_stays_behind_the_lips(pair, registered: Registration) -> None:
    bag = pair.source.bag
    error = np.linalg.norm(registered.vertices - pair.truth, axis=1) / pair.target.mesh.diagonal
    assert error[bag].mean() < 0.02
    ahead = registered.vertices[pair.source.upper].max(axis=0)[2]
    assert registered.vertices[bag][:, 2].max() < ahead


def test_a_copy_registers_onto_itself(pair) -> None:
    mesh, ids = pair.source.mesh, pair.landmarks.source
    result = register(mesh, mesh, Landmarks.of(ids, ids))
    gaps = np.linalg.norm(result.vertices - mesh.vertices, axis=1)
    assert gaps.max() < 1e-3 * mesh.diagonal
    assert result.quality.flipped_share == 0


def test_a_moved_copy_gives_the_similarity_and_the_copy(pair) -> None:
    mesh, ids = pair.source.mesh, pair.landmarks.source
    turn = Rotation.from_euler("xyz", [170, 35, -80], degrees=True).as_matrix()
    moved = mesh.with_vertices(0.01 * mesh.vertices @ turn.T + [40, -3, 7])
    result = register(mesh, moved, Landmarks.of(ids, ids))
    assert result.similarity.scale == pytest.approx(0.01, rel=1e-9)
    np.testing.assert_allclose(result.similarity.rotation, turn, atol=1e-9)
    assert np.linalg.norm(result.vertices - moved.vertices, axis=1).max() < 1e-3 * moved.diagonal


def test_the_target_s_pose_and_unit_do_not_matter(pair, registered: Registration) -> None:
    turn = Rotation.from_euler("xyz", [-20, 120, 65], degrees=True).as_matrix()
    mesh = pair.target.mesh
    moved = mesh.with_vertices(250 * mesh.vertices @ turn.T + [1000, 0, -300])
    result = register(pair.source.mesh, moved, pair.landmarks, pair.lines)
    expected = 250 * registered.vertices @ turn.T + [1000, 0, -300]
    gaps = np.linalg.norm(result.vertices - expected, axis=1)
    # Closest points are single precision, and a vertex on the edge of a filter may fall either way.
    assert np.median(gaps) < 1e-4 * moved.diagonal
    assert np.percentile(gaps, 99) < 5e-3 * moved.diagonal
    assert result.quality.misfit == pytest.approx(registered.quality.misfit)


def test_the_same_input_gives_the_same_bits(pair, registered: Registration) -> None:
    again = register(pair.source.mesh, pair.target.mesh, pair.landmarks, pair.lines)
    np.testing.assert_array_equal(again.vertices, registered.vertices)


def test_without_lines_the_skin_is_met_too(pair) -> None:
    result = register(pair.source.mesh, pair.target.mesh, pair.landmarks)
    error = np.linalg.norm(result.vertices - pair.truth, axis=1) / pair.target.mesh.diagonal
    assert error[~pair.source.bag].mean() < 0.006
    assert result.quality.wrong_sheet_share is None


def test_an_eyeball_stays_round_and_goes_along(pair, bump: TriangleMesh) -> None:
    ball = _ball(0.15, np.array([0.45, 0.3, 0.35]))
    n = pair.source.mesh.n_vertices
    whole = TriangleMesh(
        np.concatenate([pair.source.mesh.vertices, ball.vertices]),
        np.concatenate([pair.source.mesh.triangles, ball.triangles + n]).astype(np.int32),
    )
    result = register(whole, pair.target.mesh, pair.landmarks, pair.lines)
    eye = result.vertices[n:]
    radii = np.linalg.norm(eye - eye.mean(axis=0), axis=1)
    assert np.ptp(radii) < 1e-6 * radii.mean()
    assert result.interior[n:].all()
    assert np.linalg.norm(eye.mean(axis=0) - [0.52, 0.27, 0.36]) < 0.15


def test_a_part_that_the_target_lacks_follows(pair) -> None:
    mesh = pair.target.mesh
    top = mesh.vertices[:, 1].max()
    kept = (mesh.vertices[mesh.triangles][:, :, 1] < 0.88 * top).all(axis=1)
    used = np.unique(mesh.triangles[kept])
    renumber = np.full(mesh.n_vertices, -1)
    renumber[used] = np.arange(len(used))
    cut = TriangleMesh(mesh.vertices[used], renumber[mesh.triangles[kept]].astype(np.int32))
    on_cut = renumber[pair.landmarks.target] >= 0
    marks = Landmarks.of(pair.landmarks.source[on_cut], renumber[pair.landmarks.target[on_cut]])
    result = register(pair.source.mesh, cut, marks)
    beyond = (pair.truth[:, 1] > 0.95 * top) & ~pair.source.bag
    error = np.linalg.norm(result.vertices - pair.truth, axis=1) / mesh.diagonal
    assert beyond.sum() > 50
    assert error[beyond].mean() < 0.05
    assert result.vertices[beyond, 1].max() > 0.95 * top


def test_a_target_turned_inside_out_is_refused(pair) -> None:
    inside_out = TriangleMesh(pair.target.mesh.vertices, pair.target.mesh.triangles[:, ::-1].copy())
    with pytest.raises(RegistrationError, match=r"normals outside|turned over"):
        register(pair.source.mesh, inside_out, pair.landmarks)


def test_bad_landmarks_are_refused_before_any_work(pair) -> None:
    n = pair.target.mesh.n_vertices
    target = pair.landmarks.target.copy()
    target[4] = n
    with pytest.raises(InputError, match=f"'place 4' is target vertex {n}"):
        register(pair.source.mesh, pair.target.mesh, Landmarks.of(pair.landmarks.source, target, pair.landmarks.names))


def test_numbers_are_plain_and_complete(registered: Registration) -> None:
    numbers = asdict(registered.quality)
    assert all(value is None or isinstance(value, str | float) for value in numbers.values())
    assert registered.quality.accepted_share > 0.98
    assert registered.quality.landmark_worst.startswith("place")


@pytest.mark.parametrize(
    "wrong",
    [{"resolution": 0}, {"rounds": 0}, {"membrane": -1.0}, {"stiffness_last": 0.0}, {"max_angle": float("nan")}],
)
def test_parameters_out_of_range_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        RegistrationParameters(**wrong)


def test_progress_can_cancel(pair) -> None:
    def stop(what: str, done: int, total: int) -> None:
        if what == "registering" and done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        register(pair.source.mesh, pair.target.mesh, pair.landmarks, (), None, stop)


def _ball(radius: float, centre: np.ndarray) -> TriangleMesh:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=2, radius=radius)
    return TriangleMesh(np.asarray(ball.vertices) + centre, np.asarray(ball.faces, dtype=np.int32))
