"""The edges of both meshes: to draw wires, and to lead feature lines along them. Found in the worker, once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from toolkit.feature_lines import EdgePaths
from toolkit.mesh import TriangleMesh
from toolkit.progress import Progress

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["Nets"]

Net = tuple[NDArray[np.int32], EdgePaths]


class Nets:
    """``"source"`` and ``"target"`` name the meshes, as in the user's files."""

    def __init__(self, app: App) -> None:
        self._app = app
        self._known: dict[str, tuple[TriangleMesh, Net]] = {}

    def prepare(self) -> None:
        """Begin to look for both."""
        meshes = {"source": self._app.data.source, "target": self._app.data.target}

        def work(progress: Progress) -> dict[str, tuple[TriangleMesh, Net]]:
            return {name: (mesh, _net(mesh)) for name, mesh in meshes.items()}

        def done(found: dict[str, tuple[TriangleMesh, Net]]) -> None:
            self._known = found
            self._app.touch("faces", "overlay")

        self._app.run_task("preparing", work, done, slot="nets", quiet=True)

    def edges(self, name: str) -> NDArray[np.int32] | None:
        """Edges ``(E, 2)`` of a mesh, without the diagonals of its quads; None while they are looked for."""
        found = self._found(name)
        return found[0] if found is not None else None

    def paths(self, name: str) -> EdgePaths:
        """Paths along a mesh's edges."""
        found = self._found(name)
        if found is None:  # not looked for yet, or on another mesh now
            mesh = self._mesh(name)
            found = _net(mesh)
            self._known[name] = (mesh, found)
        return found[1]

    def ready(self, name: str) -> bool:
        """Whether the edges are found: else `paths` has to look for them first, which takes a while."""
        return self._found(name) is not None

    def _found(self, name: str) -> Net | None:
        mesh, net = self._known.get(name, (None, None))
        return net if mesh is self._mesh(name) else None

    def _mesh(self, name: str) -> TriangleMesh:
        return self._app.data.source if name == "source" else self._app.data.target


def _net(mesh: TriangleMesh) -> Net:
    paths = EdgePaths(mesh.vertices, mesh.triangles)
    if mesh.polygons is None:
        return paths.edges.astype(np.int32), paths
    ends = np.cumsum(mesh.polygons.counts)
    following = np.arange(1, ends[-1] + 1)
    following[ends - 1] = ends - mesh.polygons.counts
    pairs = np.sort(
        np.stack([mesh.polygons.indices, mesh.polygons.indices[following]], axis=1).astype(np.int64), axis=1
    )
    keys = np.unique(pairs[:, 0] * mesh.n_vertices + pairs[:, 1])
    return np.stack([keys // mesh.n_vertices, keys % mesh.n_vertices], axis=1).astype(np.int32), paths
