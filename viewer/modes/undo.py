"""Undo and redo of what only lives while the window is open (the journal has its own)."""

from __future__ import annotations

from typing import Generic, TypeVar

__all__ = ["UndoStack"]

T = TypeVar("T")


class UndoStack(Generic[T]):
    """Remembers states; the present one is the caller's."""

    def __init__(self) -> None:
        self._done: list[T] = []
        self._undone: list[T] = []

    @property
    def can_undo(self) -> bool:
        """Whether there is something to take back."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is something to do again."""
        return bool(self._undone)

    def push(self, before: T) -> None:
        """Something changes; this was before."""
        self._done.append(before)
        self._undone.clear()

    def undo(self, present: T) -> T | None:
        """The state before the last change, or None."""
        if not self._done:
            return None
        self._undone.append(present)
        return self._done.pop()

    def redo(self, present: T) -> T | None:
        """The state that was taken back last, or None."""
        if not self._undone:
            return None
        self._done.append(present)
        return self._undone.pop()
