"""What a detail edit acts on: the details of a take, as the result shows them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from threading import RLock
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.detail_edit.mirror import Mirror
from toolkit.detail_edit.surface import Surface
from toolkit.mesh import TriangleMesh

if TYPE_CHECKING:
    from toolkit.detail_edit.change import DetailChange

__all__ = ["DetailTake"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


class _Shared:
    """What all states of a take have in common and is worth keeping; guarded, since edits are solved on threads."""

    _MOST = 16

    def __init__(self) -> None:
        self._lock = RLock()  # making one thing may ask for another
        self._kept: dict[Any, Any] = {}

    def get(self, key: Any, make: Any) -> Any:
        """The value under a key; made once, the oldest dropped when there are many."""
        with self._lock:
            if key not in self._kept:
                while len(self._kept) >= self._MOST:
                    self._kept.pop(next(iter(self._kept)))
                self._kept[key] = make()
            self._kept[key] = value = self._kept.pop(key)
            return value


@dataclass(frozen=True, eq=False)
class DetailTake:
    """The details of a performance on one face; all on the source's topology, in the pose and size of the bases.

    ``mesh`` the target's neutral T_0, ``smooth`` (V, 3) its smoothed shape, ``frames0`` (V, 3, 3) the local frames of
    that, whose tangents point to ``neighbour`` (V,); ``details`` (T, V, 3) the motion details d_t, possibly
    memory-mapped, ``gain`` (V,) their factor g s; ``static`` (V, 3) the face's own detail e_0'; ``changes`` earlier
    edits, in their order.
    """

    mesh: TriangleMesh
    smooth: Array
    neighbour: Ids
    frames0: Array
    details: NDArray[np.float32]
    gain: Array
    static: Array
    changes: tuple[DetailChange, ...] = ()
    shared: _Shared = field(default_factory=_Shared, repr=False)

    @property
    def n_frames(self) -> int:
        """Number of frames T."""
        return len(self.details)

    @property
    def n_vertices(self) -> int:
        """Number of vertices V."""
        return len(self.smooth)

    @property
    def surface(self) -> Surface:
        """The smoothed rest shape to draw on (0.1 s for 100,000 vertices, once)."""
        return self.shared.get("surface", lambda: Surface(self.smooth, self.mesh.triangles))

    @property
    def mirror(self) -> Mirror:
        """Left and right of the face (0.3 s for 100,000 vertices, once)."""
        return self.shared.get("mirror", lambda: Mirror(self.surface))

    def unedited(self, first: int, last: int, vertices: Ids) -> NDArray[np.float32]:
        """``g s d_t`` of frames first to last, both included, at some vertices (n,): ``(last - first + 1, n, 3)``."""
        gain = self.gain[vertices, None].astype(np.float32)
        # Frame by frame: one gather over a memory-mapped take of all frames would go through all of its pages.
        return np.stack([self.details[t][vertices] * gain for t in range(first, last + 1)])

    def dynamic(self, first: int, last: int, vertices: Ids) -> NDArray[np.float32]:
        """As `unedited`, with the changes so far."""
        values = self.unedited(first, last, vertices)
        for change in self.changes:
            change.apply(values, first, vertices)
        return values

    def static_at(self, vertices: Ids) -> Array:
        """The face's own detail with the changes so far, at some vertices (n,): ``(n, 3)``."""
        values = np.array(self.static[vertices], dtype=np.float64)
        for change in self.changes:
            change.apply_static(values, vertices)
        return values

    def changed(self, *changes: DetailChange) -> DetailTake:
        """The take with further edits."""
        return replace(self, changes=(*self.changes, *changes))
