"""Landmark pairs: the same anatomical point as a vertex of the source and a vertex of the target."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.meshio.aside import written_aside

__all__ = ["Landmarks", "load_landmarks", "save_landmarks"]

Ids = NDArray[np.int64]


@dataclass(frozen=True)
class Landmarks:
    """N pairs: ``names``, ``source`` (N,) and ``target`` (N,) vertex ids, counted from 0."""

    names: tuple[str, ...]
    source: Ids
    target: Ids

    def __len__(self) -> int:
        return len(self.names)

    @classmethod
    def none(cls) -> Landmarks:
        """No pairs."""
        return cls((), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))


def load_landmarks(path: str | Path) -> Landmarks:
    """Read ``{"pairs": [{"name", "source", "target"}, ...]}``."""
    try:
        pairs = json.loads(Path(path).read_text(encoding="utf-8"))["pairs"]
        names = tuple(str(pair["name"]) for pair in pairs)
        source = np.array([_vertex(pair["source"]) for pair in pairs], dtype=np.int64)
        target = np.array([_vertex(pair["target"]) for pair in pairs], dtype=np.int64)
    except FileNotFoundError:
        raise InputError("there is no such file", where=path, remedy="give the path of a landmarks.json") from None
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"this is no landmark file ({error!r})",
            where=path,
            remedy='it should read {"pairs": [{"name": "nose_tip", "source": 17, "target": 402}]}',
        ) from error
    return Landmarks(names, source, target)


def save_landmarks(path: str | Path, landmarks: Landmarks) -> None:
    """Write the pairs so that `load_landmarks` gives them back."""
    pairs = [
        {"name": name, "source": int(source), "target": int(target)}
        for name, source, target in zip(landmarks.names, landmarks.source, landmarks.target, strict=True)
    ]
    with written_aside(path) as temporary:
        temporary.write_text(json.dumps({"pairs": pairs}, indent=1) + "\n", encoding="utf-8")


def _vertex(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"{value!r} is no vertex id")
    return value
