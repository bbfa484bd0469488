from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolkit.blocks import block_ranges, map_blocks
from toolkit.decomposition import Decomposer, coating, decompose_block, frame_neighbours, reconstruct_from_coating
from toolkit.frame_kernels import opposite_edges
from toolkit.mesh import TriangleMesh, connected_components, local_frames
from toolkit.mesh.geometry import vertex_normals
from toolkit.meshio.sequence import FrameSequence
from toolkit.operators import smoothing_average
from toolkit.smoothing import apply_steps
from toolkit.stabilisation import HeadMotion


def as_sequence(frames: np.ndarray) -> FrameSequence:
    return FrameSequence(len(frames), frames.shape[1], 30.0, "memory", lambda a, b: frames[a:b])


def shaken(frames: np.ndarray, seed: int = 5) -> tuple[np.ndarray, HeadMotion]:
    rng = np.random.default_rng(seed)
    rotations = Rotation.from_rotvec(0.2 * rng.normal(size=(len(frames), 3))).as_matrix()
    translations = rng.normal(size=(len(frames), 3))
    moved = np.einsum("tij,tvj->tvi", rotations, frames) + translations[:, None]
    return moved, HeadMotion(rotations, translations)


def decomposed(mesh: TriangleMesh, frames: np.ndarray, motion: HeadMotion | None = None) -> tuple:
    decomposer = Decomposer(mesh)
    smooth = np.full(frames.shape, np.nan, dtype=np.float32)
    details = np.full(frames.shape, np.nan, dtype=np.float32)
    motion = motion or HeadMotion.none(len(frames))
    sequence = as_sequence(frames)
    for start, stop in block_ranges(len(frames), 16):
        decompose_block(sequence, decomposer, motion, start, stop, smooth[start:stop], details[start:stop])
    return decomposer, smooth, details


def test_blocks_equal_the_definition(bump: TriangleMesh, take: np.ndarray) -> None:
    decomposer, smooth, details = decomposed(bump, take)
    average = smoothing_average(bump.triangles, bump.n_vertices)
    rest = apply_steps(average, bump.vertices, 40, 0.5, -0.53)
    for t in (0, 7, 15, 16, 39):
        smoothed = apply_steps(average, take[t], 40, 0.5, -0.53)
        frames = local_frames(smoothed, bump.triangles, decomposer.rest.neighbour)
        e_t = np.einsum("vji,vj->vi", frames, take[t] - smoothed)
        assert np.abs(smooth[t] - (smoothed - rest)).max() < 1e-6
        assert np.abs(details[t] - (e_t - decomposer.rest.detail)).max() < 1e-6


def test_frames_come_back(bump: TriangleMesh, take: np.ndarray) -> None:
    decomposer, smooth, details = decomposed(bump, take)
    rest = decomposer.rest
    for t in range(len(take)):
        large = rest.smooth + smooth[t]
        frames = local_frames(large, bump.triangles, rest.neighbour)
        again = large + np.einsum("vij,vj->vi", frames, rest.detail + details[t])
        assert np.abs(again - take[t]).max() < 1e-6 * bump.diagonal


def test_details_do_not_see_the_head_move(bump: TriangleMesh, take: np.ndarray) -> None:
    moved, motion = shaken(take)
    still = decomposed(bump, take)
    seen = decomposed(bump, moved, motion)
    for a, b in zip(still[1:], seen[1:], strict=True):
        assert np.abs(a - b).max() < 2e-6


def test_a_bent_surface_keeps_its_details(bump: TriangleMesh) -> None:
    """Turning the whole face changes no detail, although it changes every coating."""
    turn = Rotation.from_rotvec([0.4, -0.3, 0.2]).as_matrix()
    _, _, details = decomposed(bump, (bump.vertices @ turn.T)[None])
    assert np.abs(details).max() < 1e-6


def test_coating_round_trip_is_exact(bump: TriangleMesh) -> None:
    second = bump.vertices + [5.0, 0.0, 1.0]
    vertices = np.concatenate([bump.vertices, second])
    triangles = np.concatenate([bump.triangles, bump.triangles + bump.n_vertices])
    mesh = TriangleMesh(vertices, triangles)
    smooth = Decomposer(mesh).rest.smooth
    xi = coating(vertices, smooth, triangles)
    count, labels = connected_components(triangles, len(vertices))
    gauge = np.stack([(vertices - smooth)[labels == c].mean(axis=0) for c in range(count)])
    again = reconstruct_from_coating(smooth, xi, triangles, gauge)
    assert count == 2
    assert np.abs(again - vertices).max() < 1e-9 * mesh.diagonal


def test_neighbours_are_neighbours(bump: TriangleMesh) -> None:
    neighbour = frame_neighbours(bump.vertices, bump.triangles)
    edges = {tuple(e) for t in bump.triangles for e in (t[[0, 1]], t[[1, 2]], t[[2, 0]])}
    assert all((v, w) in edges or (w, v) in edges for v, w in enumerate(neighbour))
    lonely = np.vstack([bump.vertices, [[9.0, 9, 9]]])
    assert frame_neighbours(lonely, bump.triangles)[-1] == bump.n_vertices


def test_neighbours_are_the_longest_in_the_tangent_plane(bump: TriangleMesh) -> None:
    """Against the definition, vertex by vertex; of equal ones any will do."""
    neighbour = frame_neighbours(bump.vertices, bump.triangles)
    normals = vertex_normals(bump.vertices, bump.triangles)

    def in_plane(v: int, w: int) -> float:
        edge = bump.vertices[w] - bump.vertices[v]
        return float(np.linalg.norm(edge - (edge @ normals[v]) * normals[v]))

    for v in range(bump.n_vertices):
        ring = np.unique(bump.triangles[(bump.triangles == v).any(axis=1)])
        assert in_plane(v, neighbour[v]) == pytest.approx(max(in_plane(v, w) for w in ring), rel=1e-9)


def test_opposite_edges_are_turned_as_their_triangles(bump: TriangleMesh) -> None:
    starts, edges = opposite_edges(bump.triangles, bump.n_vertices + 1)
    assert starts[-1] == starts[-2] == len(edges) == 3 * bump.n_triangles  # the last vertex is in none
    for v in (0, 17, 400, bump.n_vertices - 1):
        expected = [np.roll(t, -k)[1:] for t in bump.triangles for k in np.flatnonzero(t == v)]
        assert np.array_equal(edges[starts[v] : starts[v + 1]], expected)


def test_an_error_in_a_block_is_raised(bump: TriangleMesh, take: np.ndarray) -> None:
    def broken(start: int, stop: int) -> np.ndarray:
        raise OSError("disk gone")

    sequence = FrameSequence(40, bump.n_vertices, 30.0, "memory", broken)
    out = np.empty(take.shape, dtype=np.float32)
    decomposer = Decomposer(bump)

    def work(start: int, stop: int) -> None:
        decompose_block(sequence, decomposer, HeadMotion.none(40), start, stop, out[start:stop], out[start:stop])

    with pytest.raises(OSError, match="disk gone"):
        map_blocks(work, 40, 16, what="decomposing frames")
