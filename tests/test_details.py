from __future__ import annotations

import numpy as np
import pytest

from toolkit.decomposition import Decomposer
from toolkit.details import DetailParameters, detail_gain, local_size_ratio
from toolkit.mesh import TriangleMesh


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_a_scaled_face_has_its_scale_everywhere(bump: TriangleMesh, scale: float) -> None:
    source = Decomposer(bump)
    target = Decomposer(bump.with_vertices(scale * bump.vertices))
    assert np.abs(local_size_ratio(source.rest.smooth, target) - scale).max() < 1e-9


def test_the_ratio_follows_the_face_and_not_single_triangles(bump: TriangleMesh) -> None:
    """One half of the target is stretched along x; noise in the places of vertices does not show."""
    x = bump.vertices[:, 0]
    noise = np.random.default_rng(1).normal(0, 0.15 * bump.diagonal / 40, (2, bump.n_vertices, 3))
    stretched = bump.vertices * np.stack([np.where(x > 0, 2.25, 1.0), np.ones_like(x), np.ones_like(x)], axis=1)
    target = Decomposer(bump.with_vertices(stretched + noise[0] * [1, 1, 0]))
    ratio = local_size_ratio(Decomposer(bump.with_vertices(bump.vertices + noise[1] * [1, 1, 0])).rest.smooth, target)
    far = 0.6 * x.max()
    assert np.abs(ratio[x < -far] - 1).max() < 0.1
    assert np.abs(ratio[x > far] - 1.5).max() < 0.15
    assert ratio.max() <= 3


def test_the_gain_is_the_users_times_the_ratio(bump: TriangleMesh) -> None:
    source, target = Decomposer(bump), Decomposer(bump.with_vertices(1.5 * bump.vertices))
    assert np.allclose(detail_gain(DetailParameters(gain=0.4), source.rest.smooth, target), 0.6)
    assert (detail_gain(DetailParameters(gain=0.4, scale="global"), source.rest.smooth, target) == 0.4).all()
