"""Seams: found, joined on a target, refused on a source, and not mistaken for lips that are closed at rest."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.checks import check_inputs
from toolkit.checks.seams import join_seams, seam_copies
from toolkit.errors import InputError
from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh
from toolkit.meshio.sequence import FrameSequence


def cut(mesh: TriangleMesh, charts: np.ndarray) -> tuple[TriangleMesh, np.ndarray]:
    """The mesh with a vertex for every chart ``(F,)`` that it is in, as a texture atlas splits it; old ids ``(V,)``."""
    corners = np.stack([np.repeat(charts, 3), mesh.triangles.ravel()], axis=1)
    pairs, new = np.unique(corners, axis=0, return_inverse=True)
    return TriangleMesh(mesh.vertices[pairs[:, 1]], new.reshape(-1, 3).astype(np.int32)), pairs[:, 1]


def octants(mesh: TriangleMesh) -> np.ndarray:
    """Eight charts, which meet in corners."""
    return (mesh.vertices[mesh.triangles].mean(axis=1) > 0.05) @ np.array([1, 2, 4])


def of_frames(frames: np.ndarray) -> FrameSequence:
    frames = frames.astype(np.float32)
    return FrameSequence(len(frames), frames.shape[1], 30.0, "take.npy", lambda a, b: frames[a:b])


def given(source: TriangleMesh, target: TriangleMesh, old: np.ndarray) -> dict:
    marks = np.arange(0, 140, 4)
    return {
        "source": source,
        "sequence": of_frames(np.repeat(source.vertices[None], 3, axis=0)),
        "target": target,
        "names": [f"mark{i}" for i in marks],
        "source_ids": marks,
        "target_ids": np.array([np.flatnonzero(old == i)[-1] for i in marks]),
    }


def test_a_whole_mesh_has_no_seams(head_with_eyes):
    np.testing.assert_array_equal(seam_copies(head_with_eyes), np.arange(head_with_eyes.n_vertices))
    joined = join_seams(head_with_eyes, [])
    assert joined.mesh is head_with_eyes
    assert joined.notes == ()


def test_an_atlas_is_joined_again(head):
    split, old = cut(head, octants(head))
    assert split.n_vertices > head.n_vertices + 20
    joined = join_seams(split, [])
    assert joined.mesh.n_vertices == head.n_vertices
    np.testing.assert_array_equal(joined.mesh.vertices[joined.vertex_map], split.vertices)
    # The same surface: its triangles, said in the whole head's ids, are the head's.
    back = np.empty(head.n_vertices, dtype=int)
    back[joined.vertex_map] = old
    np.testing.assert_array_equal(back[joined.mesh.triangles], head.triangles)


def test_picks_and_lines_follow_across_the_seams_of_a_target(head, caplog):
    split, old = cut(head, octants(head))
    split = split.with_vertices(100 * split.vertices)
    across = np.array([np.flatnonzero(old == i)[0] for i in (30, 35, 40, 45)])
    lines = [FeatureLine("brow", False, np.array([30, 35, 40, 45]), across)]
    checked = check_inputs(**given(head, split, old), lines=lines)
    assert checked.target.n_vertices == head.n_vertices
    assert "joined" in caplog.text
    np.testing.assert_array_equal(
        checked.target.vertices[checked.target_ids], 100 * head.vertices[np.arange(0, 140, 4)]
    )
    np.testing.assert_array_equal(checked.target.vertices[checked.lines[0].target_vertices], split.vertices[across])
    np.testing.assert_array_equal(checked.target.vertices[checked.target_vertex_map], split.vertices)


def test_a_vertex_outside_is_still_told(head):
    split, old = cut(head, octants(head))
    inputs = given(head, split, old)
    line = FeatureLine("brow", False, np.array([30, 35]), np.array([3, 9999]))
    with pytest.raises(InputError, match="vertex 9999"):
        check_inputs(**inputs, lines=[line])
    inputs["target_ids"][2] = 9999
    with pytest.raises(InputError, match="vertex 9999"):
        check_inputs(**inputs)


def test_a_source_with_seams_is_refused(head):
    split, _ = cut(head, octants(head))
    with pytest.raises(InputError, match=r"split along seams.*merge vertices"):
        check_inputs(**given(split, head.with_vertices(2 * head.vertices), np.arange(head.n_vertices)))


def test_a_source_that_falls_apart_is_refused(head):
    soup = TriangleMesh(head.vertices[head.triangles].reshape(-1, 3), np.arange(head.triangles.size).reshape(-1, 3))
    inputs = given(head, head.with_vertices(2 * head.vertices), np.arange(head.n_vertices))
    where = np.array([np.flatnonzero(head.triangles.ravel() == i)[0] for i in inputs["source_ids"]])
    frames = of_frames(np.repeat(soup.vertices[None], 3, axis=0))
    with pytest.raises(InputError, match="share no vertices"):
        check_inputs(**{**inputs, "source": soup, "sequence": frames, "source_ids": where})


def slit(head: TriangleMesh) -> tuple[TriangleMesh, np.ndarray, np.ndarray]:
    """A head with closed lips: edges along ring 5 are doubled, but for the corners; upper and lower rim."""
    ring = 1 + 20 * 5 + np.arange(1, 8)
    below = head.triangles.copy()
    touches = np.isin(below, ring[1:-1]).any(axis=1) & (
        head.vertices[below].min(axis=1)[:, 2] < head.vertices[ring[0], 2] - 1e-9
    )
    copies = np.arange(head.n_vertices)
    copies[ring[1:-1]] = head.n_vertices + np.arange(5)
    below[touches] = copies[below[touches]]
    return TriangleMesh(np.concatenate([head.vertices, head.vertices[ring[1:-1]]]), below), ring, copies[ring]


def test_closed_lips_are_no_seam_where_a_rim_runs_along_them(head):
    mask, upper, lower = slit(head)
    assert np.count_nonzero(seam_copies(mask) != np.arange(mask.n_vertices)) == 5
    rims = [FeatureLine("lip_upper", False, upper), FeatureLine("lip_lower", False, lower)]
    for lines in (rims, rims[:1]):
        np.testing.assert_array_equal(seam_copies(mask, lines), np.arange(mask.n_vertices))


def test_lips_that_open_in_the_take_are_no_seam_of_a_source(head):
    mask, _, lower = slit(head)
    frames = np.repeat(mask.vertices[None], 3, axis=0)
    frames[1, lower[1:-1], 2] -= 0.05
    inputs = given(mask, head.with_vertices(2 * head.vertices), np.arange(head.n_vertices))
    check_inputs(**{**inputs, "sequence": of_frames(frames)})
    with pytest.raises(InputError, match="5 vertices are split along seams"):
        check_inputs(**inputs)
