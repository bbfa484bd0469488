from __future__ import annotations

import numpy as np
import pytest

from toolkit.mesh import TriangleMesh
from toolkit.pose_edit import EditableTake
from toolkit.transfer import DeformationTransfer, TransferParameters

PLAIN = TransferParameters(feature_lines=False, contacts=False, robust=False)


def make_take(mesh: TriangleMesh, n_frames: int = 60) -> EditableTake:
    """Four local expressions on a face-like patch, their curves smooth, at times zero; expression 0 comes twice."""
    x, y, _ = mesh.vertices.T
    places = [(0.3, -0.6, 0.3), (-0.4, -0.5, 0.3), (0.0, -0.8, 0.4), (0.0, 0.7, 0.4)]
    directions = [(0.2, 0.1, 0.3), (-0.2, 0.1, 0.3), (0.0, -0.4, 0.1), (0.0, 0.3, 0.1)]
    bells = [np.exp(-((x - a) ** 2 + (y - b) ** 2) / c**2) for a, b, c in places]
    moves = np.stack([bell[:, None] * np.array(d) for bell, d in zip(bells, directions, strict=True)])
    t = np.linspace(0, 1, n_frames)
    curves = [
        np.exp(-(((t - 0.3) / 0.1) ** 2)) + np.exp(-(((t - 0.85) / 0.08) ** 2)),
        0.6 * np.sin(np.pi * t) ** 2,
        np.clip(np.sin(3 * np.pi * t), 0, 1) ** 2,
        0.5 * np.cos(np.pi * t) ** 2,
    ]
    weights = np.stack(curves, axis=1)
    weights[weights < 1e-3] = 0
    rest = mesh.vertices
    system = DeformationTransfer(rest, rest, mesh.triangles, moves, parameters=PLAIN)
    return EditableTake(rest, moves, weights, system)


@pytest.fixture
def face(bump: TriangleMesh) -> EditableTake:
    return make_take(bump)


@pytest.fixture
def patch(bump: TriangleMesh) -> tuple[TriangleMesh, EditableTake]:
    """Small enough for dense oracles: 7 x 8 vertices, 12 frames."""
    grid = np.arange(bump.n_vertices).reshape(24, 31)[::4, ::5][:6, :7]
    i, j = np.meshgrid(np.arange(grid.shape[0] - 1), np.arange(grid.shape[1] - 1), indexing="ij")
    a = (i * grid.shape[1] + j).ravel()
    b, c, d = a + grid.shape[1], a + grid.shape[1] + 1, a + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    mesh = TriangleMesh(bump.vertices[grid.ravel()], triangles)
    return mesh, make_take(mesh, 12)
