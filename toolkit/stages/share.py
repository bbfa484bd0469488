"""Stages that several shots have in common are done once: one performance on many targets is taken apart once."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from toolkit.meshio.aside import folder_aside
from toolkit.shot import Shot
from toolkit.stages.run import STAGES, current_key

__all__ = ["adopt_stages"]


def adopt_stages(shot: Shot, others: Iterable[Shot]) -> list[str]:
    """Take over every stage that is not up to date here, but is in another shot with the same key; say which.

    A key stands for all that went in, so the arrays are those that a run would give. They are hard links where the
    file system has them: nobody changes a stage's files in place.
    """
    others = [other for other in others if other.path.resolve() != shot.path.resolve()]
    adopted = []
    for name in STAGES:
        key = current_key(shot, name)
        if shot.is_current(name, key):
            continue
        giver = next((other for other in others if other.is_current(name, key)), None)
        if giver is not None:
            _take(giver.stage_folder(name), shot.stage_folder(name))
            adopted.append(name)
    return adopted


def _take(given: Path, folder: Path) -> None:
    with folder_aside(folder) as aside:
        for file in given.iterdir():
            try:
                os.link(file, aside / file.name)
            except OSError:  # another file system, or one without links
                shutil.copyfile(file, aside / file.name)
