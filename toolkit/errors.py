"""What can go wrong with a user's input, said in one sentence: what, where, and the remedy."""

from __future__ import annotations

from typing import Any

__all__ = ["InputError", "MissingDependencyError", "RegistrationError"]


class InputError(ValueError):
    """Input that the user has to mend. ``str(error)`` is one clear sentence; the scripts exit with code 2.

    Parameters
    ----------
    what : the fault with the actual value, e.g. ``"frame 12 has 80 001 vertices, the reference has 80 000"``
    where : the file, and the index in it if there is one, e.g. ``"take/frame_0012.obj"``
    remedy : what the user can do, e.g. ``"export the take with a fixed topology"``
    """

    def __init__(self, what: str, *, where: object = "", remedy: str = "") -> None:
        self.what = what
        self.where = str(where)
        self.remedy = remedy
        place = f"{self.where}: " if self.where else ""
        tail = f"; {remedy}" if remedy else ""
        super().__init__(f"{place}{what}{tail}.")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by the parts, so that an error from another process says the same."""
        return _again, (type(self), self.what, self.where, self.remedy)


def _again(kind: type[InputError], what: str, where: str, remedy: str) -> InputError:
    return kind(what, where=where, remedy=remedy)


class RegistrationError(InputError):
    """The two faces could not be brought into correspondence; the sentence gives the measurement and the reason."""


class MissingDependencyError(InputError):
    """A package or system library that one format needs is not installed; the remedy is the command to run."""
