"""The life of an edit being made: begun by a gesture, kept on disk, undone step by step, committed or given up."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, TypeVar

from toolkit.editing import EditSession
from toolkit.errors import InputError
from toolkit.progress import Progress
from toolkit.shot.journal import Edit
from viewer.modes.base import Mode
from viewer.modes.shared.drafts import DraftFile
from viewer.modes.shared.ground import Grounds

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["Draft", "OpenEdit"]


class Draft(Protocol):
    """An edit as far as it is made: a frozen dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def empty(self) -> bool:
        """Whether there is nothing to solve yet."""

    @property
    def frames(self) -> Sequence[int]:
        """The frames that it is about."""

    @property
    def window(self) -> tuple[int, int] | None:
        """Its window, None for all frames or for one that is found."""

    @property
    def instead_of(self) -> int | None:
        """The committed edit that it changes."""

    @property
    def highest(self) -> tuple[int, int, int]:
        """The highest frame, vertex and triangle that it names, -1 for none."""

    def data(self) -> dict[str, Any]:
        """As the journal holds it; not of an empty one."""

    def to_data(self) -> dict[str, Any]:
        """Everything of it."""


D = TypeVar("D", bound=Draft)


class OpenEdit(Mode, Generic[D]):
    """A mode with an open edit, ``draft``. A mode says how a draft is made from data, and how it is solved.

    ``kind`` is the journal's word for such edits.
    """

    kind = ""
    pairs = ("performance", "before_after", "map")

    def __init__(self, app: App, grounds: Grounds) -> None:
        super().__init__(app)
        self.grounds = grounds
        self.draft: D | None = None
        self.committing = False
        self._undo: list[D | None] = []
        self._redo: list[D | None] = []
        self._sliding = False
        self._before_slide: D | None = None

    @abstractmethod
    def draft_from(self, data: Mapping[str, Any], number: int | None = None) -> D:
        """A draft from what `Draft.to_data` or the journal holds; ``number`` of the edit that it changes."""

    @abstractmethod
    def request(self, live: bool = False) -> None:
        """Ask the worker for the draft, which is not empty; ``live`` while a gesture goes on."""

    def forget(self) -> None:
        """What was found out about the last draft is worth nothing any more."""

    # -- life -----------------------------------------------------------------------------------------------------

    def enter(self) -> None:
        """Show the open edit; a draft of another mode steps back."""
        if self.draft is not None:
            numbers = [edit.number for edit in self.app.editing.edits]
            if self.draft.instead_of is not None and self.app.editing.snapshot and self.draft.instead_of not in numbers:
                self.draft = replace(self.draft, instead_of=None)
                self._keep()
            self.app.play.window = self.draft.window
        self.solve()

    def refresh(self) -> None:
        """Another session: what was found in the old one is worth nothing."""
        self.forget()
        self.grounds.refresh()
        if self.app.editing.session is None:
            return
        if self.draft is None:
            self._restore()
        elif not self._fits(self.draft):
            self.draft = None
            self.app.say(f"the open {self.title.lower()} does not fit the shot any more and is given up", "bad")
        if self.app.mode is self:
            self.enter()

    def _fits(self, draft: D) -> bool:
        session = self.app.editing.session
        assert session is not None
        frame, vertex, triangle = draft.highest
        return frame < session.n_frames and vertex < session.n_vertices and triangle < len(session.triangles)

    def _restore(self) -> None:
        """Take up the edit that was open when the viewer was closed or killed."""
        data = DraftFile(self.app.shot).read(self.kind)
        if data is None:
            return
        try:
            kept = self.draft_from(data)
        except (InputError, KeyError, TypeError, ValueError) as error:
            self.app.say(f"the open {self.title.lower()} cannot be read: {error}", "bad")
            return
        edits = {edit.number: edit for edit in self.app.editing.edits}
        committed = not kept.empty and any(edit.data == kept.data() for edit in edits.values())
        if not self._fits(kept):
            self.app.say(f"the {self.title.lower()} that was open does not fit the shot any more", "bad")
            return
        if committed or (kept.instead_of is not None and kept.instead_of not in edits):
            self._keep()  # killed between the journal's line and this
            return
        self.draft, self._undo = kept, [None]
        if self.app.mode is not self:
            self.app.say(f"an edit was open when the viewer closed; it is still there, under {self.title}")

    def open(self, edit: Edit) -> None:
        """Open a committed edit again, to change it."""
        if self.draft is not None:
            raise InputError(f"another {self.title.lower()} is open", remedy="commit or cancel it first")
        self.draft = self.draft_from(edit.data, edit.number)
        self._undo, self._redo = [None], []
        self.forget()
        if self.draft.frames:
            self.app.go_to_frame(self.draft.frames[0])
        self._keep()

    def key_frames(self) -> Sequence[int]:
        """The frames that the open edit is about."""
        return self.draft.frames if self.draft is not None else ()

    # -- changes --------------------------------------------------------------------------------------------------

    def set(self, draft: D, final: bool = True) -> None:
        """Another draft, by the panel; ``final`` False while a slider moves, which makes one step for undo."""
        if not self._sliding:
            self._before_slide = self.draft
        self._sliding = not final
        self.draft = draft
        if final:
            self.done_with(self._before_slide)
        else:
            self.solve(live=True)

    def set_window(self, draft: D, final: bool) -> None:
        """A draft with another window, from the time line."""
        if self.draft is not None and (self._sliding or self.draft.window != draft.window):
            self.set(draft, final)

    def done_with(self, before: D | None) -> None:
        """A gesture is over that began with ``before``: remember it for undo, keep it on disk, solve to the end."""
        if self.draft != before:
            self._undo.append(before)
            self._redo.clear()
        self._keep()
        self.solve()

    def solve(self, live: bool = False) -> None:
        """Show the newest draft; requests that still wait are dropped."""
        editing = self.app.editing
        self.app.touch("overlay", "panel", "status")
        if editing.session is None or self.committing:
            return
        if self.draft is not None and not self.draft.empty:
            self.request(live)
            return
        self.forget()
        if editing.snapshot is not None and (editing.snapshot.has_draft or self.app.worker.busy):
            editing.drop_draft()

    def undo(self) -> bool:
        """The last gesture of the open edit."""
        return self._step_back(self._undo, self._redo)

    def redo(self) -> bool:
        """What undo took back; the journal is left alone while an edit is open."""
        if self.draft is not None and not self._redo:
            self.app.say("there is nothing to redo in the open edit")
            return True
        return self._step_back(self._redo, self._undo)

    def _step_back(self, source: list[D | None], goal: list[D | None]) -> bool:
        if not source or self.committing:
            return False
        goal.append(self.draft)
        self.draft = source.pop()
        if self.draft is not None:
            self.app.play.window = self.draft.window
        self._keep()
        self.solve()
        self.app.touch("timeline", "faces")
        return True

    def _keep(self) -> None:
        file, data = DraftFile(self.app.shot), None if self.draft is None else self.draft.to_data()
        self.app.saver.save((file.path, self.kind), lambda: file.write(self.kind, data))

    # -- the end --------------------------------------------------------------------------------------------------

    def commit(self) -> None:
        """Write the edit into the journal."""
        draft = self.draft
        if draft is None or draft.empty:
            self.app.say("there is nothing to commit yet", "bad")
            return
        if self.committing:
            return
        kind, data, number = self.kind, draft.data(), draft.instead_of
        self.committing = True

        def work(session: EditSession, progress: Progress) -> int:
            self.app.saver.flush()  # what is kept of it is no older than what the journal says
            if number is None:
                return session.add(kind, data, progress).number
            session.change(number, data, progress)
            return number

        def done(made: int) -> None:
            self.committing = False
            self._close()
            self.app.say(f"edit {made} is in the journal" if number is None else f"edit {made} is changed", "good")

        def failed(error: Exception) -> None:
            self.committing = False
            self.app.say(str(error) or "not committed; the edit is still open", "bad")
            self.app.touch("panel")

        try:
            self.app.editing.call("committing the edit", work, done, slot="draft", failed=failed)
        except InputError:
            self.committing = False
            raise

    def cancel(self) -> None:
        """Give the open edit up; undo brings it back."""
        if self.draft is None:
            return
        before, self.draft = self.draft, None
        self.done_with(before)
        self.app.touch("faces", "timeline")
        self.app.say("the edit is given up; undo brings it back")

    def _close(self) -> None:
        self.draft = None
        self._undo.clear()
        self._redo.clear()
        self.forget()
        self.app.play.window = None
        self._keep()
        self.app.touch()

    def ready(self) -> bool:
        """Whether edits are possible now; says why not. Stops the playback."""
        editing = self.app.editing
        if editing.session is None:
            why = f": {editing.problem}" if editing.problem else ""
            self.app.say(f"the shot is not open for edits yet{why}", "bad")
            return False
        if self.committing:
            return False
        self.app.say("")  # what was said of the last edit
        if self.app.play.playing:
            self.app.play.playing = False
            self.app.touch("timeline", "panel")
        return True
