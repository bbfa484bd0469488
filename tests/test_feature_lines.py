from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.feature_lines import (
    FeatureLine,
    find_openings,
    line_edges,
    load_feature_lines,
    save_feature_lines,
    shortest_edge_path,
    trace_lines,
)
from toolkit.mesh import TriangleMesh, unique_edges


def _length(vertices: np.ndarray, path: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(vertices[path], axis=0), axis=1).sum())


def _bellman(mesh: TriangleMesh, start: int) -> np.ndarray:
    """Slow oracle: relax every edge until nothing changes."""
    edges = unique_edges(mesh.triangles)
    lengths = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    distance = np.full(mesh.n_vertices, np.inf)
    distance[start] = 0
    while True:
        before = distance.copy()
        np.minimum.at(distance, edges[:, 1], distance[edges[:, 0]] + lengths)
        np.minimum.at(distance, edges[:, 0], distance[edges[:, 1]] + lengths)
        if np.array_equal(before, distance):
            return distance


def test_open_path_is_shortest_and_along_edges(bump: TriangleMesh) -> None:
    path = shortest_edge_path(bump.vertices, bump.triangles, [40, 700], closed=False)
    edges = {tuple(e) for e in unique_edges(bump.triangles)}
    assert (path[0], path[-1]) == (40, 700)
    assert all(tuple(sorted(pair)) in edges for pair in pairwise(path.tolist()))
    assert _length(bump.vertices, path) == pytest.approx(_bellman(bump, 40)[700])


def test_closed_path_comes_back(bump: TriangleMesh) -> None:
    path = shortest_edge_path(bump.vertices, bump.triangles, [100, 600, 640], closed=True)
    line = FeatureLine("ring", True, path)
    edges = {tuple(e) for e in unique_edges(bump.triangles)}
    assert {100, 600, 640} <= set(path.tolist())
    assert all(tuple(sorted(pair)) in edges for pair in line.edges())
    assert len(line.edges()) == len(path)


def test_tracing_leaves_paths_alone(bump: TriangleMesh) -> None:
    path = shortest_edge_path(bump.vertices, bump.triangles, [40, 700], closed=False)
    traced = trace_lines(
        [FeatureLine("whole", False, path), FeatureLine("picks", False, path[[0, 5, -1]])],
        bump.vertices,
        bump.triangles,
    )
    assert traced[0].vertices is path
    assert len(traced[1].vertices) >= len(path)


def test_unconnected_picks_are_refused(bump: TriangleMesh) -> None:
    vertices = np.vstack([bump.vertices, bump.vertices + 9])
    triangles = np.vstack([bump.triangles, bump.triangles + bump.n_vertices])
    with pytest.raises(InputError, match="no path of edges joins vertices 3 and 800"):
        shortest_edge_path(vertices, triangles, [3, 800], closed=False)
    with pytest.raises(InputError, match="pick at least 3"):
        shortest_edge_path(vertices, triangles, [3, 4], closed=True)


def test_edges_of_shared_lines_count_once() -> None:
    lines = [FeatureLine("a", False, np.array([1, 2, 3])), FeatureLine("b", True, np.array([3, 2, 9]))]
    assert line_edges(lines).tolist() == [[1, 2], [2, 3], [2, 9], [3, 9]]
    assert line_edges([]).shape == (0, 2)


def test_openings_from_arcs_and_from_rings() -> None:
    angle = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    ring = np.stack([2 * np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    vertices = np.vstack([ring, ring + [6, 0, 0]])
    loop = FeatureLine("eyelid_left", True, np.roll(np.arange(20), 3))
    upper = FeatureLine("lip_inner_upper", False, 20 + np.arange(0, 11))
    lower = FeatureLine("lip_inner_lower", False, 20 + np.array([10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 0]))
    whole = FeatureLine("lip_inner", True, 20 + np.arange(20))
    outer = FeatureLine("lip_outer", True, np.arange(20))
    mouth, eye = find_openings([loop, upper, lower, whole, outer], vertices)
    assert mouth.name == "lip_inner"
    assert (mouth.upper[0], mouth.upper[-1]) == (mouth.lower[0], mouth.lower[-1]) == (20, 30)
    assert {eye.upper[0], eye.upper[-1]} == {eye.lower[0], eye.lower[-1]} == {0, 10}
    assert set(eye.upper) | set(eye.lower) == set(range(20))


def test_guides_hold_no_edges_and_are_no_rims() -> None:
    rim = FeatureLine("lid", True, np.array([0, 1, 2, 3]))
    guides = [
        FeatureLine(f"midline_{side}", False, np.array([k, k + 4]), guide=True)
        for k, side in enumerate(("upper", "lower"))
    ]
    guides.append(FeatureLine("outline of the mouth", True, np.array([5, 6, 7]), guide=True))
    vertices = np.arange(27, dtype=float).reshape(9, 3)
    assert line_edges([rim, *guides]).tolist() == line_edges([rim]).tolist()
    assert line_edges(guides).shape == (0, 2)
    assert [opening.name for opening in find_openings([*guides, rim], vertices)] == ["lid"]


def test_guides_stay_guides(tmp_path: Path, bump: TriangleMesh) -> None:
    path = tmp_path / "feature_lines.json"
    picked = FeatureLine("jaw", False, np.array([40, 700]), np.array([3, 9]), guide=True)
    save_feature_lines(path, [picked, FeatureLine("lid", True, np.array([4, 2, 8]))])
    jaw, lid = load_feature_lines(path)
    assert (jaw.guide, lid.guide) == (True, False)
    (traced,) = trace_lines([jaw], bump.vertices, bump.triangles)
    assert traced.guide
    assert traced.target_vertices is not None
    assert len(traced.vertices) > 2


def test_file_round_trip_and_bad_files(tmp_path: Path) -> None:
    path = tmp_path / "feature_lines.json"
    save_feature_lines(path, [FeatureLine("lip", True, np.array([4, 2, 8]), np.array([1, 0]))])
    (again,) = load_feature_lines(path, 9, 2)
    assert (again.name, again.closed) == ("lip", True)
    assert again.vertices.tolist() == [4, 2, 8]
    assert again.target_vertices is not None
    assert again.target_vertices.tolist() == [1, 0]
    with pytest.raises(InputError, match=r"source vertex 8, the mesh has 8 vertices"):
        load_feature_lines(path, 8, 2)
    with pytest.raises(InputError, match="target vertex 1"):
        load_feature_lines(path, 9, 1)
    line = {"name": "lip", "closed": "no", "vertices": [1, 2]}
    maybe = {"name": "lip", "closed": False, "guide": "yes", "vertices": [1, 2]}
    for content in ({"curves": []}, {"lines": [7]}, {"lines": [line]}, {"lines": [maybe]}):
        path.write_text(json.dumps(content))
        with pytest.raises(InputError, match="no feature-line file"):
            load_feature_lines(path)


@pytest.mark.parametrize("vertex", [1.5, "1", True, None, [1, 2], 10**30])
def test_what_is_no_vertex_id_is_refused(tmp_path: Path, vertex: object) -> None:
    path = tmp_path / "feature_lines.json"
    for key in ("vertices", "target_vertices"):
        line = {"name": "lip", "closed": False, "vertices": [1, 2], key: [0, vertex]}
        path.write_text(json.dumps({"lines": [line]}), encoding="utf-8-sig")
        with pytest.raises(InputError, match=r"of the line .lip. is .*, no vertex id"):
            load_feature_lines(path)
