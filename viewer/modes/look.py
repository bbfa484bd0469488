"""Just looking: play, turn, compare."""

from __future__ import annotations

from collections.abc import Sequence

from viewer.modes.base import Mode
from viewer.state.events import Pointer
from viewer.state.rows import Note, Row

__all__ = ["Look"]


class Look(Mode):
    """Nothing is changed here; a click tells which vertex it is."""

    name = "look"
    title = "Look"

    def hint(self) -> str:
        """What a click does."""
        return "drag to turn, right drag pans, wheel zooms; a click names the vertex"

    def rows(self) -> Sequence[Row]:
        """What the shot is."""
        data = self.app.data
        words = f"{self.app.shot.path.resolve().name}: {data.n_frames} frames at {data.fps:g} a second"
        rows: list[Row] = [Note(words, "quiet")]
        if self.app.editing.opening:
            rows.append(Note("opening for edits ...", "quiet"))
        elif self.app.editing.session is not None:
            count = len(self.app.editing.edits)
            rows.append(Note(f"{count} edits" if count else "no edits yet", "quiet"))
        return rows

    def click(self, event: Pointer) -> None:
        """Name the vertex."""
        if event.hit is not None:
            x, y, z = event.hit.position
            side = self.app.pair.titles[event.pane]
            self.app.say(f"vertex {event.hit.vertex} of the {side}, at {x:.4g}, {y:.4g}, {z:.4g}")
