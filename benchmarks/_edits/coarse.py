"""Whether a decimated mesh answers pulls sooner than the exact factor, and how far its answer is from the exact one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from benchmarks._edits.timing import timed
from toolkit.mesh import TriangleMesh
from toolkit.pose_edit import Constraint, EditableTake, EditParameters, PoseEditor
from toolkit.registration.coarse import decimate
from toolkit.solve import Factor, factorise

__all__ = ["compare_with_coarse"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _System:
    """What an edit solves with: the matrix of the face as it is, and a factor of it or of its decimated copy."""

    matrix: sp.csc_matrix
    factor: Any


@dataclass(frozen=True, eq=False)
class _CoarseFactor:
    """``A^-1`` among displacements of the decimated mesh, carried up: ``P (P^T A P)^-1 P^T``."""

    prolong: sp.csr_matrix
    factor: Factor

    def solve(self, right: Array) -> Array:
        return np.asarray(self.prolong @ self.factor.solve(self.prolong.T @ right))


def compare_with_coarse(
    take: EditableTake,
    triangles: NDArray[np.integer],
    constraints: Sequence[Constraint],
    window: tuple[int, int],
    n_vertices: int,
) -> dict[str, float]:
    """Seconds of the processor to the first frame of an edit, with the exact factor and on ``n_vertices``.

    ``coarse_differs`` and ``coarse_differs_rms`` are the distance between the two edited frames as a share of the
    largest motion; both meet their constraints alike, since those are met among whatever answers there are.
    """
    mesh, parameters = TriangleMesh(take.rest, np.asarray(triangles, dtype=np.int32)), EditParameters(window=window)
    matrix = PoseEditor(take, triangles).matrix(parameters)
    near = replace(parameters, reach=0.0)  # the reach is in the matrix already
    numbers: dict[str, float] = {}
    made: dict[str, Any] = {}

    def note(name: str, work: Any) -> Any:
        numbers[name] = timed(lambda _: made.update({name: work()}), 1).cpu[0]
        return made[name]

    exact = _System(matrix, note("exact_factor_s", lambda: factorise(matrix)))
    coarse = note("coarse_decimate_s", lambda: decimate(mesh, n_vertices))
    # A vertex that no fine one lies next to is held by nothing.
    held = 1e-9 * sp.identity(coarse.mesh.n_vertices)
    factor = note("coarse_factor_s", lambda: factorise(coarse.prolong.T @ matrix @ coarse.prolong + held))
    systems = {"exact": exact, "coarse": _System(matrix, _CoarseFactor(coarse.prolong, factor))}
    editors = {name: PoseEditor(replace(take, system=system), triangles) for name, system in systems.items()}
    edits = {name: note(f"{name}_first_s", lambda e=e: e.solve(constraints, near)) for name, e in editors.items()}
    key = window[0] + (window[1] - window[0]) // 2
    before = take.smooth_frame(key)
    fine, rough = (edits[name].smooth_frame(key) for name in ("exact", "coarse"))
    largest = float(np.linalg.norm(fine - before, axis=1).max())
    apart = np.linalg.norm(fine - rough, axis=1)
    numbers["coarse_differs"] = float(apart.max()) / largest
    numbers["coarse_differs_rms"] = float(np.sqrt(np.mean(apart**2))) / largest
    return numbers
