from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from toolkit.mesh import TriangleMesh
from toolkit.meshio.sequence import FrameSequence
from toolkit.rigid import Similarity, umeyama
from toolkit.stabilisation import HeadMotion, fit_head_motion, rigid_fits


def _talking_head(bump: TriangleMesh) -> tuple[np.ndarray, np.ndarray, HeadMotion]:
    """A quarter of the vertices moves a lot, the rest not at all, while the head turns."""
    t = np.linspace(0, 1, 30)
    jaw = bump.vertices[:, 1] < -0.6
    still = np.repeat(bump.vertices[None], 30, axis=0)
    still[:, jaw, 1] -= 0.4 * np.sin(np.pi * t)[:, None] * (-0.6 - bump.vertices[jaw, 1])
    rotations = Rotation.from_rotvec(np.outer(np.sin(5 * t), [0.1, 0.3, 0.05])).as_matrix()
    translations = np.outer(t, [0.5, -0.2, 1.0])
    moved = np.einsum("tij,tvj->tvi", rotations, still) + translations[:, None]
    return still, moved, HeadMotion(rotations, translations)


def _fit(frames: np.ndarray, rest: np.ndarray) -> HeadMotion:
    return fit_head_motion(FrameSequence(len(frames), len(rest), None, "memory", lambda a, b: frames[a:b]), rest)


def test_the_jaw_does_not_turn_the_head(bump: TriangleMesh) -> None:
    _, moved, truth = _talking_head(bump)
    found = _fit(moved, bump.vertices)
    assert np.abs(found.rotations - truth.rotations).max() < 1e-5
    assert np.abs(found.translations - truth.translations).max() < 1e-5


def test_every_frame_as_fitted_alone(bump: TriangleMesh, take: np.ndarray) -> None:
    weights = np.random.default_rng(0).uniform(size=bump.n_vertices)
    motion = rigid_fits(bump.vertices, take, weights)
    for t in (0, 11, 39):
        alone = umeyama(bump.vertices, take[t], weights, scale=False)
        assert np.allclose(motion.rotations[t], alone.rotation, atol=1e-9)
        assert np.allclose(motion.translations[t], alone.translation, atol=1e-9)


def test_seen_from_the_other_face(bump: TriangleMesh) -> None:
    """Moving the source and mapping it over = mapping it over and moving it there."""
    _, _, motion = _talking_head(bump)
    similarity = Similarity(3.7, Rotation.from_rotvec([1.0, 0.3, -0.8]).as_matrix(), np.array([10.0, -3.0, 2.0]))
    there = motion.seen_from(similarity)
    for t in (3, 17):
        source = bump.vertices @ motion.rotations[t].T + motion.translations[t]
        target = similarity.apply(bump.vertices) @ there.rotations[t].T + there.translations[t]
        assert np.allclose(similarity.apply(source), target, atol=1e-12)


def test_a_still_take_stays_put(bump: TriangleMesh) -> None:
    frames = np.repeat(bump.vertices[None], 5, axis=0)
    found = _fit(frames, bump.vertices)
    assert np.abs(found.rotations - np.eye(3)).max() < 1e-7
    assert np.abs(found.translations).max() < 1e-7
