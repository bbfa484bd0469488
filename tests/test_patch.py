from __future__ import annotations

import numpy as np

from toolkit.decomposition import frame_neighbours
from toolkit.mesh import TriangleMesh
from toolkit.mesh.geometry import local_frames
from toolkit.mesh.patch import FramePatch


def test_frames_of_a_patch_are_those_of_the_mesh(bump: TriangleMesh) -> None:
    neighbour = frame_neighbours(bump.vertices, bump.triangles)
    whole = local_frames(bump.vertices, bump.triangles, neighbour)
    vertices = np.array([700, 3, 31, 4])
    patch = FramePatch.around(bump.triangles, neighbour, vertices)
    own = local_frames(bump.vertices[patch.ids], patch.triangles, patch.neighbour)
    assert np.array_equal(own[patch.at], whole[vertices])
    assert np.array_equal(patch.ids[patch.at], vertices)
    assert len(patch.ids) < 40
