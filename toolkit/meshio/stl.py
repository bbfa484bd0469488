"""STL, binary and ASCII. The format has no shared vertices: exact duplicates are merged in first-seen order."""

from __future__ import annotations

import logging
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio.faces import build_mesh
from toolkit.meshio.numbers import parse_floats

__all__ = ["merge_duplicates", "read_stl"]

logger = logging.getLogger(__name__)

_HEADER_BYTES = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"(?i)\bvertex\s+(\S+\s+\S+\s+\S+)")


def read_stl(path: str | Path) -> TriangleMesh:
    """Read an STL file; corners with exactly the same coordinates become one vertex, numbered as first seen.

    Nothing is welded by distance, so a crack in the file stays a crack for the validator to report. The vertex order
    is this reader's own: an STL cannot be the source of vertex ids that another program gave.
    """
    data = Path(path).read_bytes()
    n_facets = int.from_bytes(data[80:_HEADER_BYTES], "little") if len(data) >= _HEADER_BYTES else 0
    expected = _HEADER_BYTES + _FACET.itemsize * n_facets
    is_text = data[:512].lstrip().startswith(b"solid") and len(data) != expected
    if is_text:
        corners = _ascii_corners(data, path)
    elif len(data) < max(expected, _HEADER_BYTES):
        what = f"the header says {n_facets} facets, but the file ends before them"
        raise InputError(what, where=path, remedy="it is cut short, copy or export it again")
    else:
        facets = np.frombuffer(data, dtype=_FACET, offset=_HEADER_BYTES, count=n_facets)
        corners = facets["corners"].reshape(-1, 3).astype(np.float64)
    vertices, ids = merge_duplicates(corners)
    logger.info("%s: merged %d facet corners to %d vertices with equal coordinates", path, len(corners), len(vertices))
    return build_mesh(vertices, np.full(len(ids) // 3, 3), ids, where=path)


def merge_duplicates(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Merge rows ``(N, 3)`` with equal coordinates: the distinct rows in first-seen order, and the id of each row."""
    keys = np.ascontiguousarray(points + 0.0)  # turns -0 into 0, which compares equal but has other bits
    _, first, inverse = np.unique(keys.view("V24").ravel(), return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    return points[np.sort(first)], rank[inverse.ravel()]


def _ascii_corners(data: bytes, path: str | Path) -> NDArray[np.float64]:
    words = _VERTEX.findall(data)
    numbers = parse_floats(b"\n".join(words), 3 * len(words))
    if numbers is None or len(words) % 3 or data.lower().count(b"endfacet") * 3 != len(words):
        what = f"has {len(words)} corners that do not make up whole facets"
        raise InputError(what, where=path, remedy="it is cut short or damaged, export it again")
    return numbers.reshape(-1, 3)
