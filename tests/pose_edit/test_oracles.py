"""The solver beside slow, written-out versions of what it solves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from toolkit.contacts import ContactPairs
from toolkit.mesh import TriangleMesh
from toolkit.pose_edit import (
    DistanceConstraint,
    EditableTake,
    EditParameters,
    FixedConstraint,
    PointConstraint,
    PoseEditor,
    TouchingPairs,
)
from toolkit.pose_edit.constraints import rows_of


class Joint:
    """Eq. 12 written out in full, over all K bases and the window's weights, for SciPy."""

    def __init__(self, mesh: TriangleMesh, take: EditableTake, constraints: list, parameters: EditParameters) -> None:
        self.take, self.rows = take, rows_of(constraints, take)
        self.first, last = parameters.frames(take.n_frames)
        self.n = last - self.first + 1
        problem = PoseEditor(take, mesh.triangles)._problem(self.rows, parameters, (self.first, last))
        self.time, self.lambda_b, self.lambda_e = problem.weights.time, parameters.lambda_b, problem.lambda_e
        opening = problem.weights.opening
        self.opening = np.zeros((self.n, take.n_bases)) if opening is None else opening
        self.matrix = PoseEditor(take, mesh.triangles).matrix(parameters).toarray()
        self.picks = np.zeros((len(self.rows), take.n_vertices))
        self.picks[:, self.rows.vertices] = self.rows.combination
        # The Cholesky factor makes the bases' term a sum of squares: SciPy then needs far fewer steps.
        self.root = np.linalg.cholesky(self.matrix)

    def energy_and_gradient(self, unknowns: np.ndarray) -> tuple[float, np.ndarray]:
        take, rows = self.take, self.rows
        size = take.moves.size
        scaled = unknowns[:size].reshape(take.n_bases, take.n_vertices, 3)
        delta = np.stack([np.linalg.solve(self.root.T, d) for d in scaled])
        change = unknowns[size:].reshape(self.n, take.n_bases)
        weights = take.weights.copy()
        weights[self.first : self.first + self.n] += change
        force = self.time @ change + self.opening * change
        energy = self.lambda_b * (scaled**2).sum() + (change * force).sum()
        d_change = 2 * force
        d_delta = np.zeros_like(delta)
        for a, frame in enumerate(rows.frames):
            at = np.einsum("v,kvc->kc", self.picks[a], take.moves + delta)
            left = weights[frame] @ at - rows.goals[a]
            scale = self.lambda_e * rows.weights[a]
            energy += scale * left @ left
            d_delta += 2 * scale * np.einsum("k,v,c->kvc", weights[frame], self.picks[a], left)
            if 0 <= frame - self.first < self.n:
                d_change[frame - self.first] += 2 * scale * at @ left
        d_scaled = 2 * self.lambda_b * scaled + np.stack([np.linalg.solve(self.root, d) for d in d_delta])
        return float(energy), np.concatenate([d_scaled.ravel(), d_change.ravel()])

    def minimum(self) -> float:
        free = [(None, None)] * self.take.moves.size
        bounds = free + [(-w, None) for w in self.take.weights[self.first : self.first + self.n].ravel()]
        found = minimize(
            self.energy_and_gradient,
            np.zeros(len(bounds)),
            jac=True,
            bounds=bounds,
            method="L-BFGS-B",
            options={"maxiter": 5000, "maxfun": 20000, "ftol": 1e-12, "gtol": 1e-7, "maxcor": 40},
        )
        return float(found.fun)


@pytest.mark.parametrize(("lambda_w", "touching"), [(0.05, False), (1.0, False), (0.05, True)])
def test_reaches_the_energy_of_a_joint_bounded_solve(
    patch: tuple[TriangleMesh, EditableTake], lambda_w: float, touching: bool
) -> None:
    mesh, take = patch
    if touching:
        edge, corners = np.array([[23, 24], [24, 25]]), np.array([[8, 12], [8, 12]])
        pairs = ContactPairs(np.array([10, 11]), edge, np.array([0.5, 0.2]), np.ones(2, bool), corners)
        take = replace(take, contacts=TouchingPairs(pairs, np.repeat(np.linspace(0, 1, 12)[:, None], 2, axis=1)))
    constraints = [
        PointConstraint(4, 9, offset=(0.1, -0.05, -0.2)),
        PointConstraint(7, 30, offset=(0.0, -0.2, 0.1), weight=2.0),
        DistanceConstraint(4, (9, 24), factor=1.4),
    ]
    parameters = EditParameters(window=(2, 9), lambda_w=lambda_w, lambda_e=30.0, handle=0, tolerance=0.01)
    joint = Joint(mesh, take, constraints, parameters)
    edit = PoseEditor(take, mesh.triangles).solve(constraints, parameters)
    assert np.abs(edit.weights - take.weights).max() > 1e-3
    assert edit.energies[-1] <= 1.01 * joint.minimum()
    # The energy that it tells is that of the written-out problem.
    delta = edit.moves.of_bases()
    scaled = np.stack([joint.root.T @ d for d in delta])
    change = (edit.weights - take.weights)[2:10]
    told, _ = joint.energy_and_gradient(np.concatenate([scaled.ravel(), change.ravel()]))
    assert told == pytest.approx(edit.energies[-1], rel=1e-6)


def test_plain_alternation_stops_farther_from_it(patch: tuple[TriangleMesh, EditableTake]) -> None:
    mesh, take = patch
    editor = PoseEditor(take, mesh.triangles)
    pull = [PointConstraint(4, 9, offset=(0.1, -0.05, -0.2))]
    known, plain = (editor.solve(pull, EditParameters(lambda_w=0.05, coupled=c)) for c in (True, False))
    assert known.energies[-1] < 0.9 * plain.energies[-1]


@pytest.mark.parametrize(("held", "reach"), [(False, 0.0), (True, 0.0), (False, 0.2), (True, 0.2)])
def test_the_bases_step_solves_the_full_normal_equations(
    patch: tuple[TriangleMesh, EditableTake], held: bool, reach: float
) -> None:
    mesh, take = patch
    constraints: list = [
        PointConstraint(4, 9, offset=(0.1, -0.05, -0.2)),
        PointConstraint(7, 30, offset=(0.0, -0.2, 0.1), weight=2.0),
        PointConstraint(4, 30, place=(0.3, 0.1, 0.2)),
        DistanceConstraint(10, (9, 24), length=0.3),
    ]
    fixed = np.array([0, 1, 2, 40, 41] if held else [], dtype=int)
    if held:
        constraints.append(FixedConstraint(tuple(fixed.tolist())))
    parameters = EditParameters(mode="bases", lambda_b=2.0, handle=0, reach=reach)
    joint = Joint(mesh, take, constraints, parameters)
    free = np.setdiff1d(np.arange(take.n_vertices), fixed)
    full = joint.lambda_b * np.kron(np.eye(take.n_bases), joint.matrix[np.ix_(free, free)])
    right = np.zeros((len(full), 3))
    for a, frame in enumerate(joint.rows.frames):
        row = np.kron(take.weights[frame], joint.picks[a, free])
        scale = joint.lambda_e * joint.rows.weights[a]
        full += scale * np.outer(row, row)
        moved = np.einsum("k,v,kvc->c", take.weights[frame], joint.picks[a], take.moves)
        right += scale * np.outer(row, joint.rows.goals[a] - moved)
    expected = np.zeros_like(take.moves)
    expected[:, free] = np.linalg.solve(full, right).reshape(take.n_bases, -1, 3)
    found = PoseEditor(take, mesh.triangles).solve(constraints, parameters)
    assert np.abs(found.moves.of_bases() - expected).max() < 1e-8 * np.abs(expected).max()
    assert found.weights.tobytes() == take.weights.tobytes()
    assert np.allclose(found.bases(), take.rest + take.moves + expected, atol=1e-9)
