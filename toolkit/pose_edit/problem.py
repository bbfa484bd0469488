"""The joint problem of Eq. 12 for one set of constraints, and the rounds that solve it.

Each round changes the weights over the window, then the bases. In the paper's alternation each step takes the other's
unknowns as they are; with strong constraints the first step then does everything and the second finds nothing left to
do. Here the weights step knows how the bases will answer: eliminating them turns the constraints' weight ``lambda_e``
into the metric ``M^-1`` of `bases_metric`, at no cost, since ``M`` is small. The rounds then are Gauss-Newton steps on
the joint problem, and a handful of them reaches its optimum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.banded import FrameRows
from toolkit.pose_edit.bases_step import bases_metric
from toolkit.pose_edit.constraints import ConstraintRows
from toolkit.pose_edit.parameters import EditParameters
from toolkit.pose_edit.weights_step import WeightsProblem
from toolkit.progress import Progress

__all__ = ["EditProblem", "EditState", "solve_in_rounds"]

Array = NDArray[np.float64]

_MOST_HALVINGS = 8


@dataclass(frozen=True)
class EditState:
    """A change of the weights (n, K) with the bases that suit it best: ``row_moves`` (R, K, 3) their coefficients."""

    change: Array
    row_moves: Array
    energy: float


@dataclass(frozen=True)
class EditProblem:
    """Everything that stays the same over the rounds; ``moves`` (R, K, 3) are the bases' displacements at the rows."""

    rows: ConstraintRows
    moves: Array
    coupling: Array
    responses: Array | None
    original: Array
    first: int
    inside: NDArray[np.bool_]
    weights: WeightsProblem
    lambda_b: float
    lambda_e: float

    def weights_at(self, change: Array) -> Array:
        """The edited weights in each row's frame, ``(R, K)``."""
        weights = self.original[self.rows.frames].copy()
        weights[self.inside] += change[self.rows.frames[self.inside] - self.first]
        return weights

    def misfit(self, weights_at: Array) -> Array:
        """What the rows still ask for with these weights and the unedited bases, ``(R, 3)``."""
        return np.asarray(self.rows.goals - np.einsum("ak,akc->ac", weights_at, self.moves))

    def metric(self, weights_at: Array, coupled: bool = True) -> Array:
        """``M`` (R, R)."""
        coupling = self.coupling if coupled else np.zeros_like(self.coupling)
        return bases_metric(weights_at, coupling, self.rows.weights, self.lambda_b, self.lambda_e)

    def moves_with(self, row_moves: Array) -> Array:
        """The edited bases' displacements at the rows, ``(R, K, 3)``."""
        return np.asarray(self.moves + np.einsum("ab,bkc->akc", self.coupling, row_moves))

    def residual(self, state: EditState) -> Array:
        """What the rows still ask for after the edit, ``(R, 3)``."""
        weights_at = self.weights_at(state.change)
        return np.asarray(self.rows.goals - np.einsum("ak,akc->ac", weights_at, self.moves_with(state.row_moves)))

    def with_bases(self, change: Array) -> EditState:
        """The bases step: the best bases for a change of the weights."""
        weights_at = self.weights_at(change)
        misfit = self.misfit(weights_at)
        pull = np.linalg.solve(self.metric(weights_at), misfit)
        row_moves = np.zeros_like(self.moves)
        if self.responses is not None:
            row_moves = weights_at[:, :, None] * pull[:, None, :] / self.lambda_b
        energy = float(np.sum(misfit * pull)) + self.weights.cost(change)
        return EditState(change, row_moves, energy)

    def better_weights(self, state: EditState, coupled: bool) -> Array:
        """The weights step, ``(n, K)``."""
        weights_at, moves = self.weights_at(state.change), self.moves_with(state.row_moves)
        # Rows outside the window see no change of weights, yet pull on the bases with the others.
        frames = np.where(self.inside, self.rows.frames - self.first, 0)
        local = np.where(self.inside[:, None, None], moves, 0.0).transpose(0, 2, 1).reshape(-1, moves.shape[1])
        rows = FrameRows(np.repeat(frames, 3), local)
        now = np.einsum("ak,akc->ac", weights_at - self.original[self.rows.frames], moves)
        left = self.misfit(weights_at) if coupled else self.residual(state)
        metric: Array = np.kron(self.metric(weights_at, coupled), np.eye(3)).astype(np.float64)
        return self.weights.solve(rows, (left + now).ravel(), metric, state.change)


def solve_in_rounds(
    problem: EditProblem, change: Array, parameters: EditParameters, progress: Progress
) -> tuple[EditState, list[float]]:
    """Rounds until one gains less than the tolerance; the energy never rises."""
    state = problem.with_bases(change)
    energies = [state.energy]
    if parameters.mode == "bases":
        return state, energies
    for done in range(parameters.most_rounds):
        progress("solving the edit", done, parameters.most_rounds)
        step = problem.better_weights(state, parameters.coupled) - state.change
        better = _along(problem, state, step)
        gain = state.energy - better.energy
        state = better
        energies.append(state.energy)
        if gain <= parameters.tolerance * state.energy:
            break
    progress("solving the edit", parameters.most_rounds, parameters.most_rounds)
    return state, energies


def _along(problem: EditProblem, state: EditState, step: Array) -> EditState:
    """The best of the step and its halves; the state itself if none is better.

    The constraints are products of weights and bases, so a whole step may go too far. A trial costs next to nothing.
    """
    best = state
    for _ in range(_MOST_HALVINGS):
        trial = problem.with_bases(state.change + step)
        if trial.energy < best.energy:
            best = trial
        elif best is not state:
            break
        step = step / 2
    return best
