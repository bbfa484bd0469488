from __future__ import annotations

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh, edge_graph, unique_edges
from toolkit.pose_edit.regions import distance_from, vertices_beyond


def test_parts_that_no_edge_joins_are_as_far_as_the_crow_flies(bump: TriangleMesh) -> None:
    """Along edges on the same part, never less than straight; on another part, straight."""
    n = bump.n_vertices
    vertices = np.concatenate([bump.vertices, bump.vertices + [0, 0, 0.7]])
    graph = edge_graph(vertices, unique_edges(np.concatenate([bump.triangles, bump.triangles + n])))
    start = np.array([5, 400])
    straight = np.linalg.norm(vertices[:, None] - vertices[start], axis=2).min(axis=1)
    distance = distance_from(vertices, graph, start)
    assert np.allclose(distance[n:], straight[n:], rtol=1e-12)
    assert (distance[:n] >= straight[:n] - 1e-12).all()
    assert np.isfinite(distance).all()
    assert (distance[start] == 0).all()
    assert np.array_equal(vertices_beyond(vertices, graph, start, 0.9), np.flatnonzero(distance > 0.9))


def test_a_distance_from_nothing_is_refused(bump: TriangleMesh) -> None:
    graph = edge_graph(bump.vertices, unique_edges(bump.triangles))
    with pytest.raises(InputError, match="from where"):
        vertices_beyond(bump.vertices, graph, np.zeros(0, dtype=int), 1.0)
