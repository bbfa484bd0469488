"""Wavefront OBJ: the ``v`` lines in file order, whatever the texture seams, normals and groups say.

Libraries split or reorder vertices at seams, or lose quads; this reader takes positions and faces and nothing else.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio.aside import written_aside
from toolkit.meshio.faces import build_mesh
from toolkit.meshio.numbers import parse_floats, parse_integers

__all__ = ["face_text", "read_obj", "read_obj_positions", "vertex_text", "write_obj"]

_TAIL_COMMENT = re.compile(rb"[ \t]#[^\n]*")
_AFTER_SLASH = re.compile(rb"/\S*")
_REMEDY = "export the file again as a plain text OBJ"


def read_obj(path: str | Path) -> TriangleMesh:
    """Read the mesh of an OBJ file.

    Vertices are the ``v`` lines in their order, unreferenced ones too (a fourth number and colours are ignored);
    ``nan`` is kept for the validator. Faces are the ``f`` lines in their order, all groups together; negative
    (relative) ids are resolved.

    Raises
    ------
    InputError : a ``v`` or ``f`` line that cannot be read, or an id out of range, with its line number
    """
    lines = _Lines.of(Path(path).read_bytes())
    is_vertex, is_face = lines.starting_with(b"v"), lines.starting_with(b"f")
    vertices = _positions(lines, is_vertex, path)
    rows = np.flatnonzero(is_face)
    counts, ids = _face_ids(lines, is_face, path)
    vertices_before = np.repeat(np.cumsum(is_vertex)[rows], counts)
    if (ids == 0).any():
        face = int(np.searchsorted(np.cumsum(counts), np.flatnonzero(ids == 0)[0], side="right"))
        raise InputError(f"line {rows[face] + 1} uses vertex 0, but OBJ counts from 1", where=path, remedy=_REMEDY)
    indices = np.where(ids > 0, ids - 1, ids + vertices_before)
    return build_mesh(vertices, counts, indices, where=path, locate=lambda face: f"line {rows[face] + 1}")


def read_obj_positions(path: str | Path) -> NDArray[np.float64]:
    """Read only the vertex positions ``(V, 3)`` of an OBJ file: the frames of a sequence need no more."""
    lines = _Lines.of(Path(path).read_bytes())
    return _positions(lines, lines.starting_with(b"v"), path)


def write_obj(path: str | Path, mesh: TriangleMesh) -> None:
    """Write vertices and faces (the original polygons where there are any); reading it back gives the same bits."""
    with written_aside(path) as temporary:
        temporary.write_bytes(vertex_text(mesh.vertices) + face_text(mesh))


def face_text(mesh: TriangleMesh) -> bytes:
    """Return the ``f`` lines; a sequence formats them once."""
    if mesh.polygons is None:
        return _lines_of_ids(mesh.triangles)
    starts = np.concatenate([[0], np.cumsum(mesh.polygons.counts)])
    # Runs of faces with the same number of corners are formatted in one go, in file order.
    cuts = np.flatnonzero(np.diff(mesh.polygons.counts)) + 1
    runs = zip(np.concatenate([[0], cuts]), np.concatenate([cuts, [len(mesh.polygons.counts)]]), strict=True)
    blocks = []
    for first, last in runs:
        if last > first:
            ids = mesh.polygons.indices[starts[first] : starts[last]]
            blocks.append(_lines_of_ids(ids.reshape(last - first, -1)))
    return b"".join(blocks)


def vertex_text(vertices: NDArray[np.floating]) -> bytes:
    """Return the ``v`` lines: as many digits as bring back the same bits of the array's own precision."""
    line = "v %.9g %.9g %.9g\n" if vertices.dtype == np.float32 else "v %.17g %.17g %.17g\n"
    return (line * len(vertices) % tuple(vertices.ravel().tolist())).encode()


def _lines_of_ids(ids: NDArray[np.integer]) -> bytes:
    line = "f" + " %d" * ids.shape[1] + "\n"
    return (line * len(ids) % tuple((ids.ravel() + 1).tolist())).encode()


@dataclass(frozen=True)
class _Lines:
    """The file's bytes ``buffer`` and where each line begins; every line ends with a newline."""

    buffer: NDArray[np.uint8]
    starts: NDArray[np.int64]

    @classmethod
    def of(cls, data: bytes) -> _Lines:
        """The lines of a file, continued ones joined; any line ends, and a byte order mark or none."""
        data = data.removeprefix(b"\xef\xbb\xbf")
        if b"\r" in data and b"\n" not in data:
            data = data.replace(b"\r", b"\n")
        if b"\\\n" in data or b"\\\r\n" in data:
            data = data.replace(b"\\\r\n", b"  ").replace(b"\\\n", b"  ")
        buffer = np.frombuffer(data + b"\n\n", dtype=np.uint8)
        starts = np.concatenate([[0], np.flatnonzero(buffer == ord("\n"))[:-1] + 1])
        if np.isin(buffer[starts], (ord(" "), ord("\t"))).any():
            data = re.sub(rb"(?m)^[ \t]+", b"", data)
            return cls.of(data)
        return cls(buffer, starts)

    def starting_with(self, letter: bytes) -> NDArray[np.bool_]:
        """Mask of the lines ``(L,)`` that begin with this letter and a blank."""
        following = np.minimum(self.starts + 1, len(self.buffer) - 1)
        return (self.buffer[self.starts] == ord(letter)) & np.isin(self.buffer[following], (ord(" "), ord("\t")))

    def text(self, rows: NDArray[np.bool_]) -> bytes:
        """Return the chosen lines without their first letter and without comments."""
        lengths = np.diff(self.starts, append=len(self.buffer))
        blanked = self.buffer.copy()
        blanked[self.starts[rows]] = ord(" ")
        text = blanked[np.repeat(rows, lengths)].tobytes()
        return _TAIL_COMMENT.sub(b"", text) if b" #" in text or b"\t#" in text else text


def _words_per_line(text: bytes) -> NDArray[np.int64]:
    """Count the words of each line ``(L,)``."""
    characters = np.frombuffer(text, dtype=np.uint8)
    if len(characters) == 0:
        return np.zeros(0, dtype=np.int64)
    visible = characters > ord(" ")
    begins = visible.copy()
    begins[1:] &= ~visible[:-1]
    ends = np.flatnonzero(characters == ord("\n"))
    return np.diff(np.searchsorted(np.flatnonzero(begins), ends), prepend=0)


def _positions(lines: _Lines, is_vertex: NDArray[np.bool_], path: str | Path) -> NDArray[np.float64]:
    text = lines.text(is_vertex)
    words = _words_per_line(text)
    if (words < 3).any():
        row = np.flatnonzero(is_vertex)[np.argmax(words < 3)]
        raise InputError(f"line {row + 1} gives a vertex with fewer than 3 coordinates", where=path, remedy=_REMEDY)
    numbers = parse_floats(text, int(words.sum()))
    if numbers is None:
        raise _unreadable(text, is_vertex, path)
    first = np.cumsum(words) - words
    return numbers[first[:, None] + np.arange(3)]


def _face_ids(
    lines: _Lines, is_face: NDArray[np.bool_], path: str | Path
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners of each face ``(P,)`` and the ids as written: from 1, or negative."""
    text = lines.text(is_face)
    if b"/" in text:
        text = _AFTER_SLASH.sub(b"", text)
    counts = _words_per_line(text)
    ids = parse_integers(text, int(counts.sum()))
    if ids is None:
        raise _unreadable(text, is_face, path)
    return counts, ids


def _unreadable(text: bytes, rows: NDArray[np.bool_], path: str | Path) -> InputError:
    for row, line in zip(np.flatnonzero(rows), text.split(b"\n"), strict=False):
        if parse_floats(line, len(line.split())) is None:
            words = line.decode("ascii", "replace").strip()[:60]
            return InputError(f"line {row + 1} has a word that is not a number: {words!r}", where=path, remedy=_REMEDY)
    return InputError("holds a number that cannot be read", where=path, remedy=_REMEDY)
