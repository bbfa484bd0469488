"""How far each vertex is from where the edit takes hold: what "hold all farther than" would hold, for the tint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.mesh import edge_graph, unique_edges
from toolkit.pose_edit.constraints import handled_vertices
from toolkit.pose_edit.regions import distance_from
from toolkit.progress import Progress
from viewer.modes.pose.draft import PoseDraft

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["Beyond"]


class Beyond:
    """Measures in the worker, on the rest shape as the solver does; keeps the last answer."""

    def __init__(self, app: App) -> None:
        self._app = app
        self.distance: NDArray[np.float32] | None = None
        self._of: tuple[int, ...] = ()
        self._graph: Any = None

    def forget(self) -> None:
        """Another shape."""
        self.distance, self._of, self._graph = None, (), None

    def ask(self, draft: PoseDraft) -> None:
        """Measure for a draft, if it needs it and it is not known."""
        vertices = tuple(sorted(set(handled_vertices(draft.handles))))
        session = self._app.editing.session
        if draft.beyond is None or not vertices or vertices == self._of or session is None:
            return
        self._of = vertices

        def work(progress: Progress) -> tuple[Any, NDArray[np.float32]]:
            rest = session.rest
            graph = self._graph
            if graph is None:
                graph = edge_graph(rest, unique_edges(session.triangles))
            return graph, distance_from(rest, graph, np.array(vertices)).astype(np.float32)

        def done(found: tuple[Any, NDArray[np.float32]]) -> None:
            self._graph, self.distance = found
            self._app.touch("faces")

        self._app.run_task("measuring distances", work, done, slot="beyond", quiet=True)
