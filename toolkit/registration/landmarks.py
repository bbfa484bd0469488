"""Landmark pairs: the same anatomical point as a vertex of the source and a vertex of the target."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.meshio.aside import written_aside
from toolkit.meshio.numbers import vertex_ids

__all__ = ["Landmarks", "load_landmarks", "save_landmarks"]

Ids = NDArray[np.int64]


@dataclass(frozen=True)
class Landmarks:
    """N pairs: ``source`` (N,) and ``target`` (N,) vertex ids, counted from 0, and ``names``."""

    source: Ids
    target: Ids
    names: tuple[str, ...]

    @classmethod
    def of(
        cls,
        source: Sequence[int] | NDArray[np.integer],
        target: Sequence[int] | NDArray[np.integer],
        names: Sequence[str] = (),
    ) -> Landmarks:
        """Make pairs of vertex ids; names are made up where none are given."""
        given = tuple(names) or tuple(f"landmark {i}" for i in range(len(source)))
        if not len(source) == len(target) == len(given):
            counts = f"{len(source)} source ids, {len(target)} target ids and {len(given)} names"
            raise InputError(f"{counts} do not pair up", where="landmarks", remedy="give one of each for every pair")
        return cls(np.asarray(source, dtype=np.int64), np.asarray(target, dtype=np.int64), given)

    @classmethod
    def none(cls) -> Landmarks:
        """No pairs."""
        return cls(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), ())

    def __len__(self) -> int:
        return len(self.names)


def load_landmarks(path: str | Path) -> Landmarks:
    """Read ``{"pairs": [{"name", "source", "target"}, ...]}``; a missing name is made up.

    Raises
    ------
    InputError : no such file, not of this form, or an id that is no whole number; with the file and the pair's index
    """
    try:
        pairs = json.loads(Path(path).read_text(encoding="utf-8-sig"))["pairs"]
        rows = [_pair(pair, index) for index, pair in enumerate(pairs)]
    except FileNotFoundError:
        raise InputError("there is no such file", where=path, remedy="give the path of a landmarks.json") from None
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"this is no landmark file ({error})",
            where=path,
            remedy='it should read {"pairs": [{"name": "nose_tip", "source": 17, "target": 402}]}',
        ) from error
    return Landmarks.of([row[1] for row in rows], [row[2] for row in rows], [row[0] for row in rows])


def save_landmarks(path: str | Path, landmarks: Landmarks) -> None:
    """Write the pairs so that `load_landmarks` gives them back."""
    pairs = [
        {"name": name, "source": int(source), "target": int(target)}
        for name, source, target in zip(landmarks.names, landmarks.source, landmarks.target, strict=True)
    ]
    with written_aside(path) as temporary:
        temporary.write_text(json.dumps({"pairs": pairs}, indent=1) + "\n", encoding="utf-8")


def _pair(pair: dict[str, object], index: int) -> tuple[str, int, int]:
    if not isinstance(pair, dict):
        raise TypeError(f"pair {index} is {pair!r}")
    source, target = (int(vertex_ids([pair.get(key)], f"pair {index}: {key}")[0]) for key in ("source", "target"))
    return str(pair.get("name") or f"pair {index}"), source, target
