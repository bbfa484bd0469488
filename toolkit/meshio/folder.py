"""A take as a folder of numbered OBJ or PLY files, one a frame, read when asked for."""

from __future__ import annotations

import logging
import re
from collections import defaultdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.meshio.obj import read_obj, read_obj_positions
from toolkit.meshio.ply import read_ply, read_ply_positions
from toolkit.meshio.sequence import FrameSequence

__all__ = ["numbered_files", "open_folder"]

logger = logging.getLogger(__name__)

_READERS = {".obj": (read_obj, read_obj_positions), ".ply": (read_ply, read_ply_positions)}
_NUMBER = re.compile(r"(\d+)")


def open_folder(path: Path, fps: float | None) -> FrameSequence:
    """Open the numbered OBJ or PLY files of a folder as frames, in the order of their numbers.

    The first frame gives the faces; every frame's vertex count is checked when it is read.

    Raises
    ------
    InputError : no numbered files, several series of files, a number that is missing or there twice
    """
    files = numbered_files(path)
    read_mesh, read_positions = _READERS[files[0].suffix.lower()]
    first = read_mesh(files[0])

    def read_block(start: int, stop: int) -> NDArray[np.float32]:
        block = np.zeros((stop - start, first.n_vertices, 3), dtype=np.float32)
        for row, file in enumerate(files[start:stop]):
            positions = read_positions(file)
            if len(positions) != first.n_vertices:
                raise InputError(
                    f"has {len(positions)} vertices, but {files[0].name} has {first.n_vertices}",
                    where=file,
                    remedy="export every frame with the same topology",
                )
            block[row] = positions
        return block

    return FrameSequence(len(files), first.n_vertices, fps, str(path), read_block, first.triangles)


def numbered_files(folder: Path) -> list[Path]:
    """Return the one series of numbered mesh files in ``folder``, sorted by number (2 before 10), without gaps."""
    series: dict[tuple, list[Path]] = defaultdict(list)
    for file in folder.iterdir():
        if file.suffix.lower() in _READERS and not file.name.startswith(".") and file.is_file():
            if _NUMBER.search(file.stem):
                series[_key(file)].append(file)
            else:
                logger.info("%s: not a frame, its name has no number", file)
    if not series:
        what = "the folder holds no numbered OBJ or PLY files"
        raise InputError(what, where=folder, remedy="name the frames like frame_0001.obj, frame_0002.obj")
    if len(series) > 1:
        names = sorted(min(files).name for files in series.values())
        what = f"the folder holds {len(series)} series of files, e.g. {names[0]} and {names[1]}"
        raise InputError(what, where=folder, remedy="keep one take in a folder of its own")
    files = next(iter(series.values()))
    return _in_order(files, folder)


def _key(file: Path) -> tuple:
    """Return what the names of one series share: the text between the numbers, and the kind of file."""
    return (*_NUMBER.split(file.stem)[::2], file.suffix.lower())


def _in_order(files: list[Path], folder: Path) -> list[Path]:
    numbers = np.array([[int(n) for n in _NUMBER.findall(file.stem)] for file in files], dtype=object)
    varying = [column for column in numbers.T if len(set(column)) > 1]
    if len(varying) > 1:
        names = sorted(file.name for file in files)
        what = f"the file names differ in more than one number, e.g. {names[0]} and {names[-1]}"
        raise InputError(what, where=folder, remedy="keep one take in a folder of its own")
    frame = varying[0] if varying else numbers[:, -1]
    by_number: dict[int, Path] = {}
    for number, file in zip(frame, files, strict=True):
        if number in by_number:
            what = f"frame {number} is there twice, as {by_number[number].name} and {file.name}"
            raise InputError(what, where=folder, remedy="remove one of them")
        by_number[number] = file
    ordered = sorted(by_number)
    missing = [b for a, b in zip(ordered[1:], [n + 1 for n in ordered[:-1]], strict=True) if a != b]
    if missing:
        what = f"frame {missing[0]} is missing between {by_number[ordered[0]].name} and {by_number[ordered[-1]].name}"
        raise InputError(what, where=folder, remedy="export the missing frames, or number the files without gaps")
    return [by_number[number] for number in ordered]
