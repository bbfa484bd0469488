"""Stanford PLY, ASCII and binary of both byte orders: vertices and polygons in file order, numbers exact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import Polygons, TriangleMesh
from toolkit.meshio.aside import written_aside
from toolkit.meshio.faces import build_mesh
from toolkit.meshio.numbers import parse_floats

__all__ = ["face_bytes", "header_bytes", "read_ply", "read_ply_positions", "write_ply"]

_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"}
_TYPES |= {"double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
_TYPES |= {"float32": "f4", "float64": "f8"}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
_REMEDY = "export the file again"


@dataclass(frozen=True)
class _Property:
    name: str
    type: str
    count_type: str = ""  # of a list; empty for a scalar


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(p.count_type for p in self.properties)


@dataclass(frozen=True)
class _List:
    """A list property: ``counts`` (N,) entries of each row, ``values`` (sum,) row after row."""

    counts: NDArray[np.int64]
    values: NDArray


_Columns = dict[str, "NDArray | _List"]


def read_ply(path: str | Path) -> TriangleMesh:
    """Read vertices and faces of a PLY file; other properties (normals, colours) are skipped.

    Raises
    ------
    InputError : not a PLY, cut short, or a face that names a vertex that is not there
    """
    elements = _read_elements(path, last="face")
    vertices = _vertices(elements, path)
    faces = elements.get("face", {})
    corners = faces.get("vertex_indices", faces.get("vertex_index"))
    if not isinstance(corners, _List):
        corners = _List(np.zeros(0, np.int64), np.zeros(0, np.int64))
    return build_mesh(vertices, corners.counts, corners.values, where=path)


def read_ply_positions(path: str | Path) -> NDArray[np.float64]:
    """Read only the vertex positions ``(V, 3)``: the frames of a sequence need no more."""
    return _vertices(_read_elements(path, last="vertex"), path)


def write_ply(path: str | Path, mesh: TriangleMesh) -> None:
    """Write a little-endian binary PLY with the original polygons where there are any.

    Positions are ``float`` where that is exact and ``double`` otherwise: reading back gives the same bits.
    """
    single = mesh.vertices.astype("<f4")
    exact = np.array_equal(single, mesh.vertices, equal_nan=True)
    positions = single if exact else mesh.vertices.astype("<f8")
    with written_aside(path) as temporary:
        temporary.write_bytes(
            header_bytes(mesh, "float" if exact else "double") + positions.tobytes() + face_bytes(mesh)
        )


def header_bytes(mesh: TriangleMesh, number: str) -> bytes:
    """Return the header for positions of PLY type ``number`` (``float`` or ``double``)."""
    polygons = mesh.faces
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {mesh.n_vertices}"]
    lines += [f"property {number} {axis}" for axis in "xyz"]
    lines += [f"element face {len(polygons.counts)}", f"property list {_count_type(polygons)} int vertex_indices"]
    return "\n".join([*lines, "end_header\n"]).encode()


def face_bytes(mesh: TriangleMesh) -> bytes:
    """Return the binary rows of the face element; a sequence makes them once."""
    polygons = mesh.faces
    count = np.dtype("<" + _TYPES[_count_type(polygons)])
    row_starts = np.concatenate([[0], np.cumsum(count.itemsize + 4 * polygons.counts.astype(np.int64))])
    rows = np.zeros(row_starts[-1], dtype=np.uint8)
    count_bytes = row_starts[:-1, None] + np.arange(count.itemsize)
    rows[count_bytes] = polygons.counts.astype(count)[:, None].view(np.uint8)
    is_index = np.ones(len(rows), dtype=bool)
    is_index[count_bytes] = False
    rows[is_index] = polygons.indices.astype("<i4").view(np.uint8)
    return rows.tobytes()


def _count_type(polygons: Polygons) -> str:
    return "uchar" if polygons.counts.max(initial=0) < 256 else "int"


def _read_elements(path: str | Path, *, last: str) -> dict[str, _Columns]:
    """Read the elements up to and including ``last``."""
    data = Path(path).read_bytes()
    order, elements, offset = _parse_header(data, path)
    if order:
        source: NDArray = np.frombuffer(data, dtype=np.uint8)
        read_rows: Callable = _binary_rows
    else:
        text = data[offset:]
        numbers = parse_floats(text, len(text.split()))
        if numbers is None:
            raise InputError("the text after the header holds a word that is not a number", where=path, remedy=_REMEDY)
        source, offset, read_rows = numbers, 0, _text_rows
    columns: dict[str, _Columns] = {}
    for element in elements:
        try:
            columns[element.name], offset = read_rows(source, offset, element, order)
        except (_CutShortError, IndexError):
            what = f"the file ends inside its {element.count} {element.name} rows"
            raise InputError(what, where=path, remedy="it is cut short, copy or export it again") from None
        if element.name == last:
            break
    return columns


class _CutShortError(Exception):
    """The file ends before the element does."""


def _parse_header(data: bytes, path: str | Path) -> tuple[str, list[_Element], int]:
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise InputError("is not a PLY file: it has no PLY header", where=path, remedy=_REMEDY)
    order, elements = None, []
    for line in data[:end].decode("ascii", "replace").splitlines():
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = _ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2])))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append(_Property(words[4], _TYPES[words[3]], _TYPES[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(_Property(words[2], _TYPES[words[1]]))
        except (IndexError, KeyError, ValueError):
            raise InputError(f"has an unknown header line {line!r}", where=path, remedy=_REMEDY) from None
    if order is None:
        raise InputError("has a header without a format line", where=path, remedy=_REMEDY)
    return order, elements, data.index(b"\n", end) + 1 if b"\n" in data[end:] else len(data)


def _vertices(elements: dict[str, _Columns], path: str | Path) -> NDArray[np.float64]:
    columns = elements.get("vertex", {})
    missing = [axis for axis in "xyz" if not isinstance(columns.get(axis), np.ndarray)]
    if missing:
        raise InputError(f"has no vertex property {missing[0]}", where=path, remedy=_REMEDY)
    return np.stack([np.asarray(columns[axis], dtype=np.float64) for axis in "xyz"], axis=1)


def _binary_rows(data: NDArray[np.uint8], offset: int, element: _Element, order: str) -> tuple[_Columns, int]:
    """Read an element from bytes: in one go where every row has the same length, else by walking the rows."""
    first_counts = _list_counts_of_row(data, offset, element, order) if element.count and element.has_lists else []
    dtype = _row_type(element, first_counts, order)
    end = offset + element.count * dtype.itemsize
    if end <= len(data):
        rows = data[offset:end].view(dtype)
        lists = [p for p in element.properties if p.count_type]
        if all((rows[_count_name(p)] == n).all() for p, n in zip(lists, first_counts, strict=False)):
            return {p.name: _column(rows, p) for p in element.properties}, end
    if not element.has_lists:
        raise _CutShortError
    return _walk_binary_rows(data, offset, element, order)


def _count_name(prop: _Property) -> str:
    return f"count of {prop.name}"


def _row_type(element: _Element, list_counts: list[int], order: str) -> np.dtype:
    counts = iter(list_counts)
    fields: list[tuple] = []
    for p in element.properties:
        if p.count_type:
            fields += [(_count_name(p), order + p.count_type), (p.name, order + p.type, (next(counts, 0),))]
        else:
            fields.append((p.name, order + p.type))
    return np.dtype(fields)


def _column(rows: NDArray, prop: _Property) -> NDArray | _List:
    if not prop.count_type:
        return rows[prop.name]
    return _List(rows[_count_name(prop)].astype(np.int64), rows[prop.name].ravel())


def _list_counts_of_row(data: NDArray[np.uint8], offset: int, element: _Element, order: str) -> list[int]:
    counts = []
    for p in element.properties:
        if not p.count_type:
            offset += np.dtype(p.type).itemsize
            continue
        counts.append(_integer(data, offset, order + p.count_type))
        offset += np.dtype(p.count_type).itemsize + counts[-1] * np.dtype(p.type).itemsize
    return counts


def _integer(data: NDArray[np.uint8], offset: int, dtype: str) -> int:
    size = np.dtype(dtype).itemsize
    if offset + size > len(data):
        raise _CutShortError
    return int(data[offset]) if dtype.endswith("u1") else int(data[offset : offset + size].view(dtype)[0])


def _walk_binary_rows(data: NDArray[np.uint8], offset: int, element: _Element, order: str) -> tuple[_Columns, int]:
    lists = [p for p in element.properties if p.count_type]
    counts: dict[str, list[int]] = {p.name: [] for p in lists}
    starts: dict[str, list[int]] = {p.name: [] for p in lists}
    for _ in range(element.count):
        for p in element.properties:
            if not p.count_type:
                offset += np.dtype(p.type).itemsize
                continue
            n = _integer(data, offset, order + p.count_type)
            offset += np.dtype(p.count_type).itemsize
            counts[p.name].append(n)
            starts[p.name].append(offset)
            offset += n * np.dtype(p.type).itemsize
        if offset > len(data):
            raise _CutShortError
    return {p.name: _gather(data, counts[p.name], starts[p.name], order + p.type) for p in lists}, offset


def _gather(data: NDArray[np.uint8], counts: list[int], starts: list[int], dtype: str) -> _List:
    """Collect the lists that begin at the byte offsets ``starts``."""
    n, size = np.array(counts, dtype=np.int64), np.dtype(dtype).itemsize
    within = np.arange(n.sum()) - np.repeat(np.cumsum(n) - n, n)
    begins = np.repeat(np.array(starts, dtype=np.int64), n) + within * size
    return _List(n, data[begins[:, None] + np.arange(size)].view(dtype).ravel())


def _text_rows(numbers: NDArray[np.float64], offset: int, element: _Element, _order: str) -> tuple[_Columns, int]:
    """Read an element from the numbers of an ASCII file."""
    columns: dict[str, list] = {p.name: [] for p in element.properties}
    if not element.has_lists:
        end = offset + element.count * len(element.properties)
        if end > len(numbers):
            raise _CutShortError
        table = numbers[offset:end].reshape(element.count, len(element.properties))
        return {p.name: table[:, k] for k, p in enumerate(element.properties)}, end
    for _ in range(element.count):
        for p in element.properties:
            n = int(numbers[offset]) if p.count_type else 1
            offset += bool(p.count_type)
            columns[p.name].append(numbers[offset : offset + n])
            offset += n
        if offset > len(numbers):
            raise _CutShortError
    return {p.name: _text_column(columns[p.name], p) for p in element.properties}, offset


def _text_column(rows: list[NDArray[np.float64]], prop: _Property) -> NDArray | _List:
    values = np.concatenate(rows) if rows else np.zeros(0)
    if not prop.count_type:
        return values
    return _List(np.array([len(row) for row in rows], dtype=np.int64), values.astype(np.int64))
