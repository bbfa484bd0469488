from __future__ import annotations

import numpy as np

from toolkit.decomposition import Decomposer, decompose_block
from toolkit.details import Reconstruction
from toolkit.mesh import TriangleMesh
from toolkit.meshio.sequence import FrameSequence
from toolkit.pose_edit import EditableTake, EditParameters, PointConstraint, PoseEditor, VisibleDetails
from toolkit.rigid import Similarity
from toolkit.stabilisation import HeadMotion
from toolkit.transfer import DeformationTransfer, TransferParameters


def test_a_point_lands_where_it_was_put_on_the_rebuilt_face(bump: TriangleMesh, take: np.ndarray) -> None:
    target = Decomposer(bump)
    smooth, details = np.empty(take.shape, dtype=np.float32), np.empty(take.shape, dtype=np.float32)
    still = HeadMotion.none(len(take))
    sequence = FrameSequence(len(take), bump.n_vertices, 30.0, "memory", lambda a, b: take[a:b])
    decompose_block(sequence, target, still, 0, len(take), smooth, details)
    rest, gain = target.rest.smooth, np.full(bump.n_vertices, 1.3)
    moves = smooth[[8, 20, 39]].astype(float)
    weights = np.abs(np.linalg.lstsq(moves.reshape(3, -1).T, smooth.reshape(len(take), -1).T, rcond=None)[0].T)
    plain = TransferParameters(feature_lines=False, contacts=False, robust=False)
    system = DeformationTransfer(rest, rest, bump.triangles, moves, parameters=plain)
    before = EditableTake(rest, moves, weights, system, VisibleDetails(target, details, gain))

    def rebuilt(bases: np.ndarray, weights: np.ndarray, frame: int) -> np.ndarray:
        same = Similarity(1.0, np.eye(3), np.zeros(3))
        out = np.empty((1, bump.n_vertices, 3), dtype=np.float32)
        builder = Reconstruction(target, bases, weights, gain, still, same)
        builder.frames(frame, frame + 1, np.ascontiguousarray(details[frame : frame + 1]), out)
        return out[0]

    ids = np.array([0, 5, 100, 371, 743])
    seen = before.smooth_frame(17)[ids] + before.detail_at(17, ids)
    assert np.abs(seen - rebuilt(rest + moves, weights, 17)[ids]).max() < 1e-5
    place = seen[3] + [0.02, -0.03, 0.04]
    point = PointConstraint(17, 371, place=tuple(place))
    edit = PoseEditor(before, bump.triangles).solve([point], EditParameters(window=(10, 25), lambda_e=1e5))
    # The details turn with the edited surface a little.
    assert np.abs(rebuilt(edit.bases(), edit.weights, 17)[371] - place).max() < 0.05 * 0.04
