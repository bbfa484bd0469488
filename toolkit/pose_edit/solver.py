"""Edits of one take: constraints to a joint problem, and its solution to what the user gets."""

from __future__ import annotations

import copy
from collections import OrderedDict
from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import edge_graph, unique_edges
from toolkit.pose_edit.bases_step import Responses
from toolkit.pose_edit.constraints import (
    BeyondConstraint,
    Constraint,
    ConstraintRows,
    FixedConstraint,
    check_ids,
    handled_vertices,
    rows_of,
)
from toolkit.pose_edit.handles import Handles
from toolkit.pose_edit.parameters import EditParameters
from toolkit.pose_edit.problem import EditProblem, EditState, solve_in_rounds
from toolkit.pose_edit.regions import vertices_beyond
from toolkit.pose_edit.result import PoseEdit, Residual
from toolkit.pose_edit.take import EditableTake, LowRankMoves
from toolkit.pose_edit.weights_step import WeightsProblem, time_matrix
from toolkit.progress import Progress, silent

__all__ = ["PoseEditor"]

Array = NDArray[np.float64]

# Sets of held vertices whose factors are kept; one is about 200 MB at 100,000 vertices.
_MOST_FACTORS = 2


class PoseEditor:
    """Solves edits of one take; keeps what the next solve can use, so that dragging is a chain of small solves.

    Parameters
    ----------
    take : what is edited
    triangles : (F, 3) of the mesh
    """

    def __init__(self, take: EditableTake, triangles: NDArray[np.integer]) -> None:
        self.take = take
        self._graph = edge_graph(take.rest, unique_edges(triangles))
        self._edge = float(np.median(self._graph.data))
        self._reach = _reach(take)
        self._n_triangles = np.bincount(np.asarray(triangles).ravel(), minlength=take.n_vertices)
        self._diagonal = float(np.sqrt(np.sum(np.ptp(take.rest, axis=0) ** 2)))
        self._responses: OrderedDict[tuple[float, float, bytes], Responses] = OrderedDict()
        self._gram: tuple[NDArray[np.int64], Array] | None = None
        self._opened: Array | None = None
        self._last: tuple[EditParameters, Array] | None = None

    def following(self, take: EditableTake) -> PoseEditor:
        """An editor of the same face after other edits; what does not depend on them is shared."""
        other = copy.copy(self)
        other.take, other._gram, other._opened, other._last = take, None, None, None
        return other

    def solve(
        self,
        constraints: Sequence[Constraint],
        parameters: EditParameters | None = None,
        *,
        warm: bool = False,
        progress: Progress = silent,
    ) -> PoseEdit:
        """Bases and weights that meet the constraints with the least change.

        ``warm`` begins from the last solution with the same parameters: quicker while a pointer moves, but the result
        then depends, within the tolerance, on the way there; commit a cold solve. An exception from ``progress``
        cancels and leaves everything as it was. Without constraints the result is the take itself.
        """
        if self.take.n_bases == 0:
            raise InputError(
                "the take has no bases, so there is no motion that a pose could be edited by",
                remedy="give a lower threshold in [bases] and run the stages again; a still take has none at any",
            )
        parameters = parameters or EditParameters()
        window = parameters.frames(self.take.n_frames)
        resolved = self._with_ids(constraints)
        rows = rows_of(resolved, self.take)
        if not len(rows):
            residuals = tuple(Residual(constraint, 0.0, 0.0) for constraint in constraints)
            return PoseEdit(self.take, self.take.weights, None, window, residuals, (0.0,))
        problem = self._problem(rows, parameters, window)
        change = np.zeros_like(problem.weights.lower)
        if warm and self._last is not None and self._last[0] == parameters:
            change = np.maximum(self._last[1], problem.weights.lower)
        try:
            state, energies = solve_in_rounds(problem, change, parameters, progress)
        except np.linalg.LinAlgError as error:
            raise InputError(
                "some constraints weigh so much that nothing is left of the rest", remedy="give smaller weights"
            ) from error
        self._last = (parameters, state.change)
        residuals = self._residuals(constraints, resolved, rows, problem, state)
        return self._result(rows, problem, state, residuals, energies)

    def _with_ids(self, constraints: Sequence[Constraint]) -> list[Constraint]:
        """The constraints with the vertices that are named by distance, one for one."""
        found: list[Constraint] = []
        for constraint in constraints:
            if isinstance(constraint, BeyondConstraint):
                start = np.asarray(constraint.vertices or handled_vertices(constraints), dtype=np.int64)
                check_ids(start, self.take.n_vertices, "vertex")
                ids = vertices_beyond(self.take.rest, self._graph, start, constraint.distance)
                found.append(FixedConstraint(tuple(ids.tolist()), weight=constraint.weight))
            else:
                found.append(constraint)
        return found

    def _problem(self, rows: ConstraintRows, parameters: EditParameters, window: tuple[int, int]) -> EditProblem:
        take = self.take
        first, last = window
        n = last - first + 1
        inside = (rows.frames >= first) & (rows.frames <= last)
        if parameters.mode == "weights" and not inside.all():
            raise InputError(
                f"frame {rows.frames[~inside][0]} is edited but lies outside the window from {first} to {last}",
                remedy='widen the window, or let the bases change too (mode "both")',
            )
        responses = None
        if parameters.mode != "weights":
            responses = self._responses_of(rows.held, parameters)(rows.vertices)
        # Constraints in units of the median edge; weights in units of what they move, evened out over the window.
        lambda_e = parameters.lambda_e / self._edge**2 * (0.1 if parameters.mode == "weights" else 1.0)
        lambda_w = parameters.lambda_w * (self._reach / self._edge) ** 2 * n / 4
        time = lambda_w * time_matrix(n, first > 0, last < take.n_frames - 1, parameters.smoothness)
        gram = None if not len(rows.held) else lambda_e * rows.held_weight * self._held_gram(rows.held)
        opening = self._opening(rows, window, lambda_e * parameters.contacts)
        moves = np.einsum("au,kuc->akc", rows.combination, take.moves_at(rows.vertices))
        coupling = np.zeros((len(rows), len(rows)))
        if responses is not None:
            coupling = rows.combination @ responses[rows.vertices] @ rows.combination.T
        return EditProblem(
            rows=rows,
            moves=moves,
            coupling=coupling,
            responses=responses,
            original=take.weights,
            first=first,
            inside=inside,
            weights=WeightsProblem(time, gram, -take.weights[first : last + 1], opening),
            lambda_b=parameters.lambda_b,
            lambda_e=lambda_e,
        )

    def prepare(self, parameters: EditParameters) -> None:
        """Make the factor that solves with these parameters need, so that the first of them does not wait for it."""
        self._responses_of(np.zeros(0, dtype=np.int64), parameters)

    def _responses_of(self, held: NDArray[np.int64], parameters: EditParameters) -> Responses:
        key = (parameters.handle, parameters.reach, held.tobytes())
        if key not in self._responses:
            handles = Handles(self._graph, parameters.handle * self._diagonal)
            self._responses[key] = Responses(self.take.system, held, handles, self._screening(parameters))
        self._responses.move_to_end(key)
        while len(self._responses) > _MOST_FACTORS:
            self._responses.popitem(last=False)
        return self._responses[key]

    def _screening(self, parameters: EditParameters) -> Array | None:
        if parameters.reach == 0:
            return None
        return np.asarray(self._n_triangles / (3 * (parameters.reach * self._diagonal) ** 2))

    def matrix(self, parameters: EditParameters) -> sp.csc_matrix:
        """What a change of a basis costs, ``delta^T matrix delta``: the transfer's own matrix, and the reach's part."""
        screening = self._screening(parameters)
        matrix = self.take.system.matrix
        return matrix if screening is None else sp.csc_matrix(matrix + sp.diags(screening))

    def _held_gram(self, held: NDArray[np.int64]) -> Array:
        """Inner products of the bases' displacements over the held vertices, ``(K, K)``."""
        if self._gram is None or not np.array_equal(self._gram[0], held):
            moved = self.take.moves_at(held).reshape(self.take.n_bases, -1)
            self._gram = (held, moved @ moved.T)
        return self._gram[1]

    def _opening(self, rows: ConstraintRows, window: tuple[int, int], weight: float) -> Array | None:
        """What opening closed lids and lips costs, (n, K): not of those that a constraint takes hold of."""
        contacts = self.take.contacts
        if contacts is None or weight == 0:
            return None
        if self._opened is None:
            self._opened = contacts.opened_by(self.take.moves_at(contacts.pairs.vertices))
        first, last = window
        return np.asarray(weight * contacts.let_go(rows.vertices).touching[first : last + 1] @ self._opened)

    def _result(
        self,
        rows: ConstraintRows,
        problem: EditProblem,
        state: EditState,
        residuals: tuple[Residual, ...],
        energies: list[float],
    ) -> PoseEdit:
        last = problem.first + len(state.change) - 1
        weights = self.take.weights.copy()
        weights[problem.first : last + 1] = np.maximum(weights[problem.first : last + 1] + state.change, 0)
        moves = None
        if problem.responses is not None:
            small = np.einsum("au,akc->ukc", rows.combination, state.row_moves)
            moves = LowRankMoves(problem.responses, small)
        return PoseEdit(self.take, weights, moves, (problem.first, last), residuals, tuple(energies))

    def _residuals(
        self,
        constraints: Sequence[Constraint],
        resolved: Sequence[Constraint],
        rows: ConstraintRows,
        problem: EditProblem,
        state: EditState,
    ) -> tuple[Residual, ...]:
        """One for each constraint; ``resolved`` are the same with their vertices named."""
        left = np.sqrt(np.sum(problem.residual(state) ** 2, axis=1))
        asked = np.sqrt(np.sum(problem.misfit(problem.original[rows.frames]) ** 2, axis=1))
        residuals = []
        for index, (constraint, named) in enumerate(zip(constraints, resolved, strict=True)):
            mine = rows.owners == index
            if isinstance(named, FixedConstraint) and named.frames is None:
                residuals.append(Residual(constraint, self._held_motion(named, state.change), 0.0))
            else:
                residuals.append(
                    Residual(constraint, float(left[mine].max(initial=0)), float(asked[mine].max(initial=0)))
                )
        return tuple(residuals)

    def _held_motion(self, constraint: FixedConstraint, change: Array) -> float:
        ids = np.asarray(constraint.vertices, dtype=np.int64)
        moved = self.take.moves_at(ids).reshape(self.take.n_bases, -1)
        squared = np.einsum("tk,kl,tl->t", change, moved @ moved.T, change)
        return float(np.sqrt(max(float(squared.max(initial=0)), 0.0) / max(len(ids), 1)))


def _reach(take: EditableTake) -> float:
    """How far the bases move the face: root mean square over the bases of the largest displacement."""
    squared = [float(np.einsum("vc,vc->v", move, move).max(initial=0)) for move in take.moves]
    return max(float(np.sqrt(np.mean(squared))) if squared else 0.0, 1e-12 * float(np.abs(take.rest).max(initial=1)))
