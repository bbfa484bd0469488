"""Which steps of a shot are done, and what to do next: what leads a user through an unfinished shot."""

from __future__ import annotations

from dataclasses import dataclass

from toolkit.errors import InputError
from toolkit.shot import Shot
from toolkit.stages import STAGES, current_key

__all__ = ["Steps", "find_steps"]

_WORDS = {
    "inputs": "read and check the files",
    "register": "register the target",
    "decompose": "take the wrinkles apart",
    "bases": "choose bases",
    "transfer": "transfer the bases",
    "result": "build the frames",
}


@dataclass(frozen=True)
class Steps:
    """``states``: stage to done, old (its inputs changed since) or missing; ``problem`` with the files."""

    states: dict[str, str]
    problem: str = ""

    @property
    def open(self) -> tuple[str, ...]:
        """The stages to run, in order."""
        return tuple(name for name, state in self.states.items() if state != "done")

    def done(self, name: str) -> bool:
        """Whether a stage is up to date."""
        return self.states.get(name) == "done"

    def lines(self) -> list[str]:
        """One line a stage."""
        signs = {"done": "done", "old": "out of date", "missing": "to do"}
        return [f"{_WORDS.get(name, name)}: {signs[state]}" for name, state in self.states.items()]


def find_steps(shot: Shot) -> Steps:
    """Compare every stage with the shot's files; a new `Shot` is made, since shot.toml may have changed."""
    states: dict[str, str] = {}
    problem = ""
    try:
        fresh = Shot(shot.path)
        for name in STAGES:
            if fresh.is_current(name, current_key(fresh, name)):
                states[name] = "done"
            else:
                states[name] = "missing" if fresh.manifest(name) is None else "old"
    except InputError as error:
        problem = str(error)
    return Steps({name: states.get(name, "missing") for name in STAGES}, problem)
