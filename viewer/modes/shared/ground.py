"""The surface that regions and curves are drawn on, fetched from the edit session once, off the main thread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from toolkit.detail_edit import Dab, DetailTake, Surface, painted
from toolkit.progress import Progress

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["Ground", "Grounds"]


@dataclass(frozen=True, eq=False)
class Ground:
    """``surface`` is the smoothed rest shape; a length on it times ``scale`` is one in the result's unit.

    ``take`` has what else belongs to the face, as the map from left to right.
    """

    surface: Surface
    scale: float
    take: DetailTake


class Grounds:
    """Holds the ground of the open session; the modes share it."""

    def __init__(self, app: App) -> None:
        self._app = app
        self.ground: Ground | None = None
        self._of: object = None

    def refresh(self) -> None:
        """The session was opened or closed: fetch its ground."""
        session = self._app.editing.session
        if session is None:
            self.ground, self._of = None, None
            return
        if self._of is session:
            return
        self._of, self.ground = session, None

        def work(progress: Progress) -> Ground:
            take = session.detail_take
            surface = take.surface
            scale = 1 / session.in_pose_of_bases(1.0)
            # The first dab compiles; it must not do so under the user's hand.
            triangle = int(len(surface.triangles) // 2)
            corner = surface.at_vertex(int(surface.triangles[triangle, 0]))
            painted(surface, [Dab(corner, 2 * surface.edge())])
            return Ground(surface, scale, take)

        def done(ground: Ground) -> None:
            if self._of is session:
                self.ground = ground
                self._app.touch("panel", "overlay")

        self._app.run_task("preparing to paint", work, done, quiet=True)
