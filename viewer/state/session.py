"""The edit session as the window sees it: every call that may take long runs in the worker, and leaves a snapshot.

The session has one lock; the main thread never waits for it. It draws from the snapshot that the last call left, whose
states build frames on their own.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, TimeoutError
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from toolkit.editing import EditSession
from toolkit.errors import InputError
from toolkit.progress import Progress
from toolkit.shot.journal import Edit

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["Editing", "Snapshot"]

_CACHE_BYTES = 256 * 2**20
_AHEAD = 8
_MOMENT = 0.03
"""Seconds that the main thread waits for a frame: most are there by then, and nobody notices."""

Key = tuple[int, bool, int]


@dataclass(frozen=True, eq=False)
class Snapshot:
    """What the session said after its last call.

    ``shown`` and ``base`` build frames with and without edits, ``moved`` (T,) how far edits move each frame at most.
    """

    edits: tuple[Edit, ...]
    can_undo: str | None
    can_redo: str | None
    has_draft: bool
    weights: NDArray[np.float64]
    edited_weights: NDArray[np.float64]
    moved: NDArray[np.float64]
    shown: Any
    base: Any
    problems: dict[int, str] = field(default_factory=dict)

    @property
    def changed(self) -> bool:
        """Whether anything shown differs from the automatic result."""
        return self.shown is not self.base


class Editing:
    """Opens the session when the shot is ready, and runs calls on it."""

    def __init__(self, app: App) -> None:
        self._app = app
        self.session: EditSession | None = None
        self.snapshot: Snapshot | None = None
        self.opening = False
        self.problem = ""
        self._builder = ThreadPoolExecutor(1, "viewer-frames")
        self._asked: dict[Key, Future[NDArray[np.float32]]] = {}
        self._frames: OrderedDict[Key, NDArray[np.float32]] = OrderedDict()

    # -- life -----------------------------------------------------------------------------------------------------

    def open_if_ready(self) -> None:
        """Open the session in the worker if the stages are up to date and it is not open yet."""
        steps = self._app.steps
        if self.session is not None or self.opening or steps is None:
            return
        if not all(steps.done(name) for name in ("inputs", "register", "decompose", "bases", "transfer")):
            return
        self.opening, shot = True, self._app.shot

        def work(progress: Progress) -> tuple[EditSession, Snapshot]:
            session = EditSession.open(shot, progress)
            return session, _snapshot(session, None)

        def done(opened: tuple[EditSession, Snapshot]) -> None:
            self.opening = False
            if shot is not self._app.shot:
                return
            self.session, self.problem = opened[0], ""
            self._take(opened[1])
            self._app.refresh_modes()
            self._app.touch()

        def failed(error: Exception) -> None:
            self.opening, self.problem = False, str(error)
            self._app.say(f"no edits for now: {error}", "bad")
            self._app.touch("panel")

        self._app.run_task("opening the shot for edits", work, done, failed=failed)

    def drop_draft(self) -> None:
        """Show the face without the open edit."""
        self.call("showing the face", lambda session, _: session.drop_draft(), slot="draft", quiet=True, solves=False)

    def close(self) -> None:
        """Forget the session: the shot's stages were run again."""
        self.session, self.snapshot, self.problem = None, None, ""
        self._frames.clear()
        self._asked.clear()

    # -- frames ---------------------------------------------------------------------------------------------------

    def frame(self, frame: int, edited: bool) -> NDArray[np.float32]:
        """A frame of the result, with all active edits and the draft or without; waits until it is built."""
        state = self._state(edited)
        if state is None:
            return np.asarray(self._app.data.result[frame])
        key = (id(state), edited, frame)
        if key not in self._frames:
            self._keep(key, self._ask(key, state).result())
        return self._known(key)

    def frame_soon(self, frame: int, edited: bool) -> NDArray[np.float32] | None:
        """The same; None where that would take longer than a moment, `ready` tells when it is there."""
        state = self._state(edited)
        if state is None:
            return np.asarray(self._app.data.result[frame])
        key = (id(state), edited, frame)
        if key not in self._frames and key not in self._asked:
            self._drop_asked()  # others were for frames that nobody looks at any more
            with suppress(TimeoutError):
                self._ask(key, state).result(_MOMENT)
        return self._known(key) if self.ready(frame, edited) else None

    def ready(self, frame: int, edited: bool) -> bool:
        """Whether a frame can be shown at once."""
        state = self._state(edited)
        key = (id(state), edited, frame)
        if state is not None and key in self._asked and self._asked[key].done():
            self._keep(key, self._asked.pop(key).result())
        return state is None or key in self._frames

    def build_ahead(self, wanted: Iterable[bool]) -> None:
        """While it plays: build the next frames in a thread; ``wanted`` True for edited ones, False for the others."""
        play = self._app.play
        for step in range(1, _AHEAD + 1):
            frame = (play.frame + step) % play.n_frames
            for edited in wanted:
                state = self._state(edited)
                if state is not None and not self.ready(frame, edited) and len(self._asked) < 2 * _AHEAD:
                    self._ask((id(state), edited, frame), state)

    def _state(self, edited: bool) -> Any:
        """What builds the frames; None where they are on disk."""
        shown = self.snapshot
        if shown is None or (not shown.edits and not shown.has_draft):
            return None
        return shown.shown if edited else shown.base

    def _ask(self, key: Key, state: Any) -> Future[NDArray[np.float32]]:
        if key not in self._asked:
            self._asked[key] = self._builder.submit(state.frame, key[2])
        return self._asked[key]

    def _drop_asked(self) -> None:
        """Frames that are not begun yet are not built."""
        for key in [key for key, future in self._asked.items() if future.cancel()]:
            del self._asked[key]

    def _known(self, key: Key) -> NDArray[np.float32]:
        self._frames.move_to_end(key)
        return self._frames[key]

    def _keep(self, key: Key, shape: NDArray[np.float32]) -> None:
        self._asked.pop(key, None)
        self._frames[key] = shape
        most = max(4 * _AHEAD, _CACHE_BYTES // max(shape.nbytes, 1))
        while len(self._frames) > most:
            self._frames.popitem(last=False)

    # -- calls ----------------------------------------------------------------------------------------------------

    def call(
        self,
        name: str,
        work: Callable[[EditSession, Progress], Any],
        done: Callable[[Any], None] = lambda result: None,
        *,
        slot: str | None = None,
        failed: Callable[[Exception], None] | None = None,
        quiet: bool = False,
        live: bool = False,
        solves: bool = True,
    ) -> None:
        """Run ``work(session, progress)`` in the worker; show what the session says then, and call ``done(result)``.

        ``live`` is for calls while a pointer moves: the marks on the time line are left as they were. Of calls that
        solve nothing (``solves``) the time is not told.
        """
        session = self.session
        if session is None:
            raise InputError("the shot is not open for edits yet", remedy=self.problem or "wait until it is opened")
        before, frame = self.snapshot, self._app.play.frame

        def run(progress: Progress) -> tuple[Any, Snapshot, NDArray[np.float32], float]:
            began = time.perf_counter()
            result = work(session, progress)
            seconds = time.perf_counter() - began
            snapshot = _snapshot(session, before, live)
            return result, snapshot, snapshot.shown.frame(frame), seconds

        def finished(answer: tuple[Any, Snapshot, NDArray[np.float32], float]) -> None:
            result, snapshot, shape, seconds = answer
            if session is not self.session:
                return
            self._take(snapshot)
            self._keep((id(snapshot.shown), True, frame), shape)
            if solves:
                self._app.solved(seconds)
            done(result)
            self._app.touch("panel")

        self._app.run_task(name, run, finished, slot=slot, quiet=quiet, failed=failed)

    def _take(self, snapshot: Snapshot) -> None:
        old = self.snapshot
        self.snapshot = snapshot
        self._drop_asked()
        self._asked.clear()
        # Only frames of states that are still shown are worth keeping; ids of dead ones may come again.
        kept = {id(snapshot.shown), id(snapshot.base)}
        if old is not None:
            for key in [key for key in self._frames if key[0] not in kept]:
                del self._frames[key]
        self._app.faces_changed()

    # -- for panels and the time line -----------------------------------------------------------------------------

    @property
    def edits(self) -> tuple[Edit, ...]:
        """All edits, switched off ones too."""
        return self.snapshot.edits if self.snapshot is not None else ()

    def moved_share(self) -> NDArray[np.float64] | Sequence[float]:
        """How much edits change each frame, 0..1 of the most."""
        if self.snapshot is None or not len(self.snapshot.moved):
            return ()
        most = float(self.snapshot.moved.max())
        # What is below a thousandth of the largest move is rounding.
        return np.where(self.snapshot.moved > 1e-3 * most, self.snapshot.moved / max(most, 1e-300), 0.0)


def _snapshot(session: EditSession, before: Snapshot | None, live: bool = False) -> Snapshot:
    """Ask the session for everything that is shown; runs in the worker."""
    edits = session.edits
    shown, base = session.state, session.unedited_state
    known = before is not None and (live or before.shown is shown)
    moved = before.moved if before is not None and known else session.edited_frames()
    problems = {edit.number: text for edit in edits if (text := session.problem(edit.number))}
    return Snapshot(
        edits,
        session.can_undo,
        session.can_redo,
        session.has_draft,
        session.weights,
        session.edited_weights,
        moved,
        shown,
        base,
        problems,
    )
