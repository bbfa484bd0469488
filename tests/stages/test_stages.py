from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolkit.errors import InputError
from toolkit.feature_lines import FeatureLine, save_feature_lines
from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.rigid import Similarity
from toolkit.shot import Shot
from toolkit.stages import STAGES, run_stages
from toolkit.stages.register import load_pose
from toolkit.stages.result import open_reconstruction


def make_shot(folder: Path, mesh: TriangleMesh, frames: np.ndarray, target: np.ndarray, extra: str = "") -> Shot:
    folder.mkdir(parents=True, exist_ok=True)
    write_mesh(folder / "source.ply", mesh)
    write_mesh(folder / "target.ply", mesh.with_vertices(target))
    np.save(folder / "take.npy", frames.astype(np.float32))
    text = '[source]\nreference="source.ply"\nframes="take.npy"\nfps=30\n[target]\nreference="target.ply"\n'
    (folder / "shot.toml").write_text(text + extra)
    grid = np.arange(mesh.n_vertices).reshape(24, 31)
    lower = np.concatenate([grid[6:7, 15], grid[7:17, 14], grid[17:18, 15]])
    lines = [FeatureLine("lip_inner_upper", False, grid[6:18, 15]), FeatureLine("lip_inner_lower", False, lower)]
    save_feature_lines(folder / "feature_lines.json", lines)
    return Shot(folder)


def shaken(frames: np.ndarray) -> np.ndarray:
    turns = np.outer(np.sin(np.linspace(0, 6, len(frames))), [0.1, 0.2, -0.05])
    rotations = Rotation.from_rotvec(turns).as_matrix()
    return (
        np.einsum("tij,tvj->tvi", rotations, frames) + np.outer(np.linspace(0, 1, len(frames)), [0.3, 0, -0.2])[:, None]
    )


ALL_BASES = "[bases]\nthreshold = 0.0\n"


def test_onto_itself_the_source_comes_back(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    moved = shaken(take).astype(np.float32)
    shot = make_shot(tmp_path, bump, moved, bump.vertices, ALL_BASES)
    run_stages(shot)
    assert np.abs(shot.array("result", "frames") - moved).max() < 1e-6 * bump.diagonal


def test_stages_cut_short_are_made_anew(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    shot = make_shot(tmp_path, bump, take, bump.vertices)
    run_stages(shot)
    whole = shot.frames_path.read_bytes()
    for file, left in ((shot.stage_folder("decompose") / "details.npy", 500), (shot.frames_path, 20)):
        os.truncate(file, left)
    done = {report.stage: report.skipped for report in run_stages(shot)}
    assert (done["register"], done["decompose"], done["bases"], done["result"]) == (True, False, True, False)
    assert shot.frames_path.read_bytes() == whole


def test_a_moved_copy_gives_the_moved_performance(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    pose = Similarity(7.3, Rotation.from_rotvec([0.5, -1.9, 0.7]).as_matrix(), np.array([20.0, -5.0, 40.0]))
    moved = shaken(take).astype(np.float32)
    shot = make_shot(tmp_path, bump, moved, pose.apply(bump.vertices), ALL_BASES)
    run_stages(shot)
    found = load_pose(shot)
    assert found.scale == pytest.approx(7.3)
    expected = pose.apply(moved)
    assert np.abs(shot.array("result", "frames") - expected).max() < 1e-5 * 7.3 * bump.diagonal


def test_default_threshold_leaves_the_bases_residual(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    shot = make_shot(tmp_path, bump, take, bump.vertices)
    run_stages(shot)
    frames = shot.array("result", "frames")
    errors = np.sqrt(((frames - take.astype(np.float32)) ** 2).sum(axis=2).mean(axis=1))
    own = np.array(shot.array("bases", "frame_errors"))
    # Details ride on frames turned by the residual, so the two agree up to a little of the details.
    assert (errors < 1.1 * own + 1e-5).all()
    assert 0 < len(shot.array("bases", "frames")) < 12
    assert errors.max() > 1e-4


@pytest.mark.parametrize("stabilised", ["true", "false"])
def test_a_still_take_gives_a_still_result(bump: TriangleMesh, tmp_path: Path, stabilised: str) -> None:
    """Stabilised, rounding makes a basis of one frame; else there are none at all."""
    target, still = bump.vertices * [1.4, 0.9, 1.2], bump.with_vertices(bump.vertices.astype(np.float32))
    extra = f"[stabilise]\nenabled = {stabilised}\n"
    shot = make_shot(tmp_path, still, np.repeat(still.vertices[None], 6, axis=0), target, extra)
    run_stages(shot)
    frames = np.array(shot.array("result", "frames"))
    assert np.abs(frames - target).max() < 1e-5
    assert np.abs(frames - frames[0]).max() == 0


def test_where_no_basis_is_wanted_the_details_move_alone(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    shot = make_shot(tmp_path, bump, take, bump.vertices, "[bases]\nthreshold = 2.0\n")
    run_stages(shot)
    assert shot.array("transfer", "bases").shape == (0, bump.n_vertices, 3)
    moved = np.array(shot.array("result", "frames")) - bump.vertices
    assert 0 < np.abs(moved).max() < np.abs(take - bump.vertices).max()


def test_only_what_changed_is_run_again(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    shot = make_shot(tmp_path, bump, take, bump.vertices * [1.2, 1, 1])

    def ran() -> list[str]:
        return [report.stage for report in run_stages(Shot(tmp_path)) if not report.skipped]

    assert ran() == list(STAGES)
    assert ran() == []
    toml = tmp_path / "shot.toml"
    toml.write_text(toml.read_text() + "[details]\ngain = 0.5\n")
    assert ran() == ["transfer", "result"]
    toml.write_text(toml.read_text() + "[bases]\ncount = 3\n")
    assert ran() == ["bases", "transfer", "result"]
    np.save(tmp_path / "take.npy", take[::-1].astype(np.float32))
    assert ran() == list(STAGES)
    shot.frames_path.unlink()
    assert ran() == ["result"]


def test_another_target_leaves_the_performance_as_it_is(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    shot = make_shot(tmp_path, bump, take, bump.vertices * [1.2, 1, 1])
    run_stages(shot)
    write_mesh(tmp_path / "target.ply", bump.with_vertices(bump.vertices * [1, 1.3, 1]))
    ran = [report.stage for report in run_stages(Shot(tmp_path)) if not report.skipped]
    assert ran == ["inputs", "register", "transfer", "result"]
    write_mesh(tmp_path / "source.ply", bump.with_vertices(bump.vertices * 1.001))
    ran = [report.stage for report in run_stages(Shot(tmp_path)) if not report.skipped]
    assert ran == list(STAGES)


def test_same_inputs_same_bytes(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    results = []
    for name in ("a", "b"):
        shot = make_shot(tmp_path / name, bump, shaken(take), bump.vertices * [1.2, 1, 1])
        run_stages(shot)
        results.append(shot.frames_path.read_bytes())
    assert results[0] == results[1]


def test_any_frame_alone_equals_the_take(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    shot = make_shot(tmp_path, bump, take, bump.vertices * [1.2, 1, 1])
    run_stages(shot)
    reconstruction = open_reconstruction(shot)
    out = np.empty((1, bump.n_vertices, 3), dtype=np.float32)
    for t in (0, 17, 39):
        reconstruction.frames(t, t + 1, np.array(shot.array("decompose", "details")[t : t + 1]), out)
        assert np.abs(out[0] - shot.array("result", "frames")[t]).max() < 1e-6


def test_gain_zero_keeps_the_targets_own_detail(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    """The ripple that comes and goes in the take is gone, the ripple of the rest face is not."""
    results = {}
    for gain in (0.0, 1.0, 2.0):
        extra = f"[details]\ngain = {gain}\n[transfer]\ncontacts = false\n"
        shot = make_shot(tmp_path / str(gain), bump, take, bump.vertices, extra)
        run_stages(shot)
        results[gain] = np.array(shot.array("result", "frames"), dtype=float)
    assert np.abs(results[0.0][0] - bump.vertices).max() < 1e-5
    assert np.allclose(results[2.0] - results[1.0], results[1.0] - results[0.0], atol=1e-5)
    assert np.abs(results[1.0] - results[0.0]).max() > 0.01


def test_the_papers_coating_is_a_choice(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    """On the source itself the two ways agree; a strong screening is the displacement form."""
    shot = make_shot(tmp_path / "a", bump, take, bump.vertices, ALL_BASES + '[details]\nmethod = "coating"\n')
    run_stages(shot)
    assert np.abs(shot.array("result", "frames") - take).max() < 0.02
    results = []
    for name, extra in (("b", '[details]\nmethod = "coating"\nscreening = 1e6\n'), ("c", "")):
        other = make_shot(tmp_path / name, bump, take, bump.vertices * [1.3, 1, 0.9], extra)
        run_stages(other)
        results.append(np.array(other.array("result", "frames")))
    assert np.abs(results[0] - results[1]).max() < 1e-5


def test_cancelling_keeps_what_was(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    shot = make_shot(tmp_path, bump, take, bump.vertices)
    run_stages(shot)
    before = shot.frames_path.read_bytes()

    def cancel(what: str, done: int, total: int) -> None:
        if what == "building frames":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_stages(shot, ["result"], force=True, progress=cancel)
    assert shot.frames_path.read_bytes() == before
    assert not list(tmp_path.glob(".*part*"))


def test_frames_are_checked_without_landmarks_too(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    take[7, 100, 1] = np.nan
    shot = make_shot(tmp_path, bump, take, bump.vertices)
    with pytest.raises(InputError, match="frame 7: vertex 100 has no finite position"):
        run_stages(shot)
    assert not (tmp_path / "result").exists()


def test_another_topology_needs_landmarks(bump: TriangleMesh, take: np.ndarray, tmp_path: Path) -> None:
    shot = make_shot(tmp_path, bump, take, bump.vertices)
    write_mesh(tmp_path / "target.ply", TriangleMesh(bump.vertices, bump.triangles[:-1]))
    with pytest.raises(InputError, match="landmarks"):
        run_stages(shot)
    with pytest.raises(InputError, match="the stages are"):
        run_stages(shot, ["transfr"])
