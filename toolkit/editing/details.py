"""Where edits of details join the stack."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.decomposition import Decomposer
from toolkit.detail_edit import DetailChange, DetailEdit, DetailTake, PasteEdit, from_data, solve_detail_edit
from toolkit.errors import InputError
from toolkit.mesh.geometry import local_frames
from toolkit.shot import Shot
from toolkit.stages import current_key
from toolkit.stages.transfer import target_decomposer

__all__ = ["DetailSolver", "detail_take"]


class DetailSolver:
    """Solves detail edits of one shot on what earlier ones left; other shots that edits copy from are kept open."""

    def __init__(self, shot: Shot, take: DetailTake) -> None:
        self.take = take
        self._shot = shot
        self._others: dict[Path, tuple[str, DetailTake]] = {}

    def solve(self, edit: DetailEdit | Mapping[str, Any], changes: Sequence[DetailChange]) -> DetailChange:
        """``edit`` may be given as the journal holds it."""
        if isinstance(edit, Mapping):
            edit = from_data({name: value for name, value in edit.items() if name != "note"})
        other = None
        if isinstance(edit, PasteEdit) and edit.source_shot is not None:
            other = self._other(edit.source_shot)
        return solve_detail_edit(edit, self.take.changed(*changes), other)

    def _other(self, name: str) -> DetailTake:
        """Another shot's details, as it was before any edits; ``name`` its folder, from this shot's folder."""
        path = (self._shot.path / name).resolve()
        shot = Shot(path)
        key = current_key(shot, "transfer")
        if path not in self._others or self._others[path][0] != key:
            if not shot.is_current("transfer", key):
                raise InputError(
                    "an edit copies from this shot, whose stages are not up to date",
                    where=path,
                    remedy=f"run scripts/run_all.py {path}",
                )
            take = detail_take(shot, target_decomposer(shot))
            if not np.array_equal(take.mesh.triangles, self.take.mesh.triangles):
                raise InputError(
                    "an edit copies from this shot, which has another topology",
                    where=path,
                    remedy="copy between shots of the same performer",
                )
            self._others = {path: (key, take)}
        return self._others[path][1]


def detail_take(shot: Shot, target: Decomposer) -> DetailTake:
    """A shot's unedited details on its target."""
    rest = target.rest
    return DetailTake(
        mesh=target.mesh,
        smooth=rest.smooth,
        neighbour=rest.neighbour,
        frames0=local_frames(rest.smooth, target.mesh.triangles, rest.neighbour),
        details=shot.array("decompose", "details"),
        gain=np.array(shot.array("transfer", "gain")),
        static=rest.detail,
    )
