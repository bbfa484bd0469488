"""The edges of a face as bands of triangles, added bit by bit: half a million corners at once take long."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.rendering import Camera
from viewer import overlay
from viewer.view.open3d_calls import DynamicMesh

__all__ = ["Wires"]

_COLOR = np.array([0.06, 0.06, 0.07], np.float32)
_BIT = 12_000  # edges that are added in one go


class Wires:
    """Edges ``(E, 2)`` of a mesh in a scene."""

    def __init__(self, scene: Any, edges: NDArray[np.int32]) -> None:
        self._scene, self.edges = scene, edges
        self._bits: list[tuple[DynamicMesh, NDArray[np.int32]]] = []

    @property
    def whole(self) -> bool:
        """Whether all edges are in the scene."""
        return _BIT * len(self._bits) >= len(self.edges)

    def draw(self, positions: NDArray[np.float32], camera: Camera, height: float) -> None:
        """Lay them along the vertices ``positions`` (V, 3), for a pane ``height`` pixels high; add another bit."""
        if not self.whole:
            start = _BIT * len(self._bits)
            edges = np.ascontiguousarray(self.edges[start : start + _BIT])
            triangles = overlay.wire_triangles(len(edges))
            self._bits.append((DynamicMesh(self._scene, f"wires {start}", triangles, 4 * len(edges)), edges))
        for mesh, edges in self._bits:
            corners, colors = mesh.next_buffers()
            colors[:] = _COLOR
            overlay.wires(positions, edges, camera, height, corners)
            mesh.show()

    def remove(self) -> None:
        """Take them out of the scene."""
        for mesh, _ in self._bits:
            mesh.remove()
