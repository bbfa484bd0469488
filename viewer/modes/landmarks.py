"""Landmarks: the same anatomical point on the performer and on the target, pair by pair.

Every finished pair, and every correction, is written to landmarks.json at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from toolkit.checks.picks import NEEDED_LANDMARKS
from toolkit.registration.landmarks import Landmarks, load_landmarks, save_landmarks
from toolkit.rendering.camera import triple
from viewer.modes.base import Mode
from viewer.modes.undo import UndoStack
from viewer.picking import pixels_from_ray
from viewer.state.events import Key, Pointer
from viewer.state.marks import BLUE, ORANGE, YELLOW, Disc, Mark
from viewer.state.rows import Button, Buttons, Entry, Items, Note, Row

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["LandmarkMode", "Pair"]

_GRAB = 9.0  # pixels
_ROUNDING = 1e-5  # of the face's height


@dataclass(frozen=True)
class Pair:
    """One landmark: vertex ids on both meshes; one of them None while it is half picked."""

    name: str
    source: int | None = None
    target: int | None = None

    def on(self, side: str) -> int | None:
        """Its vertex on the mesh ``"source"`` or ``"target"``."""
        return self.source if side == "source" else self.target

    def put(self, side: str, vertex: int) -> Pair:
        """The pair with another vertex on one mesh."""
        return replace(self, source=vertex) if side == "source" else replace(self, target=vertex)

    @property
    def whole(self) -> bool:
        """Whether it has both."""
        return self.source is not None and self.target is not None


class LandmarkMode(Mode):
    """Pick on one face, then on the other."""

    name = "landmarks"
    title = "Landmarks"
    pairs = ("references", "registration", "take")
    hits_in_drag = True

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._pairs: tuple[Pair, ...] = ()
        self._undo: UndoStack[tuple[Pair, ...]] = UndoStack()
        self.chosen = -1
        self._held: tuple[int, str] | None = None
        self._before: tuple[Pair, ...] = ()
        self.refresh()

    @property
    def count(self) -> int:
        """How many whole pairs there are."""
        return sum(pair.whole for pair in self._pairs)

    # -- what is shown --------------------------------------------------------------------------------------------

    def hint(self) -> str:
        """What a click does."""
        half = self._half
        if half is None:
            return f"click a point on either face for landmark {len(self._pairs) + 1}, or drag one to correct it"
        other = "target" if half.target is None else "source"
        return f'click the same point on the {other} for "{half.name}" (Esc drops it)'

    def rows(self) -> Sequence[Row]:
        """The list, the name, and what can be done."""
        words = [
            f"{number:3d}  {pair.name}   {_id(pair.source)} - {_id(pair.target)}" for number, pair in self._numbered
        ]
        rows: list[Row] = [Items("landmark", tuple(words), self.chosen, 12, "no landmarks yet")]
        chosen = self._pairs[self.chosen] if 0 <= self.chosen < len(self._pairs) else None
        rows.append(Entry("landmark name", "name", chosen.name if chosen else ""))
        rows.append(
            Buttons(
                (
                    Button("landmark delete", "Delete", chosen is not None),
                    Button("undo", "Undo", self._undo.can_undo),
                    Button("redo", "Redo", self._undo.can_redo),
                    Button("landmark save", "Save"),
                )
            )
        )
        rows.append(Note(f"{self.count} pairs, kept in {self.app.shot.landmarks_path.name} as you pick", "quiet"))
        steps = self.app.steps
        if steps is not None and not steps.problem:
            label = "Register again" if self.app.data.has_registration else "Register"
            enough = self.count >= NEEDED_LANDMARKS or steps.done("register")
            rows.append(Button("run:register", label, enough and self.app.worker.progress is None))
            if not enough:
                rows.append(Note(f"to register, pick {NEEDED_LANDMARKS} pairs at least", "quiet"))
        if self.app.data.has_registration:
            numbers = (self.app.shot.manifest("register") or {}).get("numbers", {})
            rows += _report(numbers)
        return rows

    def marks(self, pane: int) -> Sequence[Mark]:
        """A numbered disc for every landmark."""
        surface = self.app.surface(pane)
        found = []
        for number, pair in self._numbered:
            vertex = pair.on(surface.mesh)
            if vertex is not None and vertex < len(surface.vertices):
                color = YELLOW if number - 1 == self.chosen else (BLUE if pair.whole else ORANGE)
                found.append(Disc(triple(surface.vertices[vertex]), color, 5.0, str(number)))
        return found

    def keys(self) -> Sequence[tuple[str, str]]:
        """Delete."""
        return (("delete", "delete the chosen landmark"),)

    # -- gestures -------------------------------------------------------------------------------------------------

    def press(self, event: Pointer) -> bool:
        """Take hold of a landmark under the pointer."""
        found = self._under(event)
        if found < 0:
            return False
        self._held, self._before, self.chosen = (found, self.app.surface(event.pane).mesh), self._pairs, found
        self.app.touch("overlay", "panel")
        return True

    def drag(self, event: Pointer) -> None:
        """The landmark follows over the surface."""
        if self._held is None or event.hit is None:
            return
        index, side = self._held
        if self.app.surface(event.pane).mesh == side:
            self._put(index, self._pairs[index].put(side, event.hit.vertex))

    def release(self, event: Pointer) -> None:
        """Where it is let go, it stays."""
        self.drag(event)
        self._held = None
        if self._pairs != self._before:
            self._undo.push(self._before)
            self._save()

    def click(self, event: Pointer) -> None:
        """A new landmark, or the other half of one."""
        if event.hit is None:
            return
        side = self.app.surface(event.pane).mesh
        half = self._half
        if half is not None:
            self._change((*self._pairs[:-1], half.put(side, event.hit.vertex)))
        else:
            taken = {pair.name for pair in self._pairs}
            number = next(n for n in range(len(self._pairs) + 1, 10**6) if f"landmark {n}" not in taken)
            self._change((*self._pairs, Pair(f"landmark {number}").put(side, event.hit.vertex)))
        self.chosen = len(self._pairs) - 1

    def key(self, event: Key) -> bool:
        """Escape drops a half pair, Delete the chosen one."""
        if event.name == "escape" and self._half is not None:
            self._change(self._pairs[:-1])
            return True
        if event.name in ("delete", "backspace"):
            self._delete()
            return True
        return False

    def panel(self, name: str, value: Any, final: bool) -> None:
        """The list, the name, delete, save."""
        if name == "landmark" and 0 <= int(value) < len(self._pairs):
            self.chosen = int(value)
        elif name == "landmark name" and 0 <= self.chosen < len(self._pairs) and str(value).strip():
            if self._pairs[self.chosen].name != str(value).strip():
                renamed = replace(self._pairs[self.chosen], name=str(value).strip())
                self._change(_with(self._pairs, self.chosen, renamed))
        elif name == "landmark delete":
            self._delete()
        elif name == "landmark save":
            words = f"{self.count} pairs are in {self.app.shot.landmarks_path}"
            self._save(lambda: self.app.say(words, "good"))

    def undo(self) -> bool:
        """Take back the last pick or correction."""
        return self._restore(self._undo.undo(self._pairs))

    def redo(self) -> bool:
        """Do it again."""
        return self._restore(self._undo.redo(self._pairs))

    def refresh(self) -> None:
        """Read landmarks.json."""
        path = self.app.shot.landmarks_path
        if not path.exists():
            return
        known = load_landmarks(path)
        rows = zip(known.names, known.source, known.target, strict=True)
        pairs = tuple(Pair(name, int(source), int(target)) for name, source, target in rows)
        if pairs != tuple(pair for pair in self._pairs if pair.whole):
            self._pairs, self._undo, self.chosen = pairs, UndoStack(), -1

    # -- inside ---------------------------------------------------------------------------------------------------

    @property
    def _numbered(self) -> list[tuple[int, Pair]]:
        return list(enumerate(self._pairs, start=1))

    @property
    def _half(self) -> Pair | None:
        """The pair that is half picked: always the last."""
        return self._pairs[-1] if self._pairs and not self._pairs[-1].whole else None

    def _under(self, event: Pointer) -> int:
        """Index of the landmark under the pointer that can be seen, or -1."""
        surface = self.app.surface(event.pane)
        on = [(i, v) for i, p in enumerate(self._pairs) if (v := p.on(surface.mesh)) is not None]
        on = [(i, v) for i, v in on if v < len(surface.vertices)]
        if not on or event.hit is None:
            return -1
        ids = np.array([v for _, v in on])
        camera, height = self.app.framing_camera(event.pane), self.app.plain_height(event.pane)
        apart = pixels_from_ray(
            np.array(event.origin), np.array(event.direction), surface.vertices[ids], camera, height
        )
        apart[~self.app.picker(event.pane).visible(ids, camera)] = np.inf
        best = int(np.argmin(apart))
        return on[best][0] if apart[best] <= _GRAB else -1

    def _put(self, index: int, pair: Pair) -> None:
        self._pairs = _with(self._pairs, index, pair)
        self.app.touch("overlay")

    def _change(self, pairs: tuple[Pair, ...]) -> None:
        self._undo.push(self._pairs)
        self._pairs = pairs
        self._save()

    def _restore(self, pairs: tuple[Pair, ...] | None) -> bool:
        if pairs is None:
            return False
        self._pairs = pairs
        self.chosen = min(self.chosen, len(pairs) - 1)
        self._save()
        return True

    def _delete(self) -> None:
        if 0 <= self.chosen < len(self._pairs):
            self._change(self._pairs[: self.chosen] + self._pairs[self.chosen + 1 :])
            self.chosen = min(self.chosen, len(self._pairs) - 1)

    def _save(self, done: Callable[[], None] = lambda: None) -> None:
        whole, path = [pair for pair in self._pairs if pair.whole], self.app.shot.landmarks_path
        source, target = [p.source or 0 for p in whole], [p.target or 0 for p in whole]
        landmarks = Landmarks.of(source, target, [p.name for p in whole])
        self.app.saver.save(path, lambda: save_landmarks(path, landmarks), done)
        self.app.touch("overlay", "panel", "status")
        self.app.check_steps()


def _with(pairs: tuple[Pair, ...], index: int, pair: Pair) -> tuple[Pair, ...]:
    return (*pairs[:index], pair, *pairs[index + 1 :])


def _id(vertex: int | None) -> str:
    return "?" if vertex is None else str(vertex)


def _report(numbers: dict[str, Any]) -> list[Row]:
    """What the registration said of itself."""
    rows: list[Row] = []
    if "distance_95_share" in numbers:
        most = numbers["distance_95_share"]
        words = (
            f"95 % of it nearer than {_percent(most)} to the target" if most > _ROUNDING else "it lies on the target"
        )
        rows.append(Note(f"registered: {words}", "quiet"))
        far = _percent(numbers.get("landmark_worst_share", 0.0))
        rows.append(Note(f"worst landmark: {numbers.get('landmark_worst', '')}, {far} of the face away", "quiet"))
    rows += [Note(str(warning), "bad") for warning in numbers.get("warnings", [])[:3]]
    return rows


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"
