"""Feature lines round eyes and mouth: connected edges on the source's topology, drawn from a few picked vertices.

A line may also carry the matching line on the target's own mesh, which the registration uses, and two lines may be the
two sides of an opening (upper and lower lid, upper and lower lip), which the contacts use. A guide is a line that only
the registration uses: along brows, nose and jaw, where the transfer should not hold edges.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from toolkit.errors import InputError
from toolkit.mesh import edge_graph, unique_edges
from toolkit.meshio.aside import written_aside
from toolkit.meshio.numbers import vertex_ids

__all__ = [
    "EdgePaths",
    "FeatureLine",
    "Opening",
    "corners_of",
    "find_openings",
    "halves",
    "line_edges",
    "load_feature_lines",
    "save_feature_lines",
    "shortest_edge_path",
    "trace_lines",
]

log = logging.getLogger(__name__)

Ids = NDArray[np.int64]

# A closed line with one of these in its name is the rim of an opening; "outer" ones are not.
_OPENING_WORDS = ("lid", "lip", "mouth", "eye")


@dataclass(frozen=True)
class FeatureLine:
    """One line: ``vertices`` (n,) source vertex ids in order, ``closed`` if the last joins the first.

    ``target_vertices`` (m,) the same line on the target's own mesh, if the user gave it; its number of vertices and its
    starting point may differ. ``guide``: only the registration uses it, neither transfer nor contacts.
    """

    name: str
    closed: bool
    vertices: Ids
    target_vertices: Ids | None = None
    guide: bool = False

    def edges(self) -> Ids:
        """Its consecutive pairs of vertices, ``(n, 2)`` closed or ``(n - 1, 2)`` open."""
        following = np.roll(self.vertices, -1)
        pairs = np.stack([self.vertices, following], axis=1)
        return pairs if self.closed else pairs[:-1]


@dataclass(frozen=True)
class Opening:
    """The two sides of a mouth or an eye: ``upper`` and ``lower`` (n,) and (m,) vertex ids, corner to corner."""

    name: str
    upper: Ids
    lower: Ids


class EdgePaths:
    """The edges of a mesh as a graph, to find paths in it: made once, it answers in milliseconds.

    Parameters
    ----------
    vertices : (V, 3)
    triangles : (F, 3)

    ``edges`` (E, 2) are all of them, the lower id first.
    """

    def __init__(self, vertices: NDArray[np.floating], triangles: NDArray[np.integer]) -> None:
        self.edges = unique_edges(triangles)
        self._vertices = vertices
        self._keys = self.edges[:, 0] * len(vertices) + self.edges[:, 1]
        self._graph = edge_graph(vertices, self.edges)

    def through(self, picks: Sequence[int] | Ids, closed: bool) -> Ids:
        """As `shortest_edge_path`."""
        stops = [int(p) for p in picks]
        if len(stops) < (3 if closed else 2):
            raise InputError(
                f"{len(stops)} picked vertices make no {'closed' if closed else 'open'} line",
                remedy=f"pick at least {3 if closed else 2}",
            )
        path = [stops[0]]
        for start, end in zip(stops, stops[1:] + stops[:1] if closed else stops[1:], strict=False):
            path += self._between(start, end)
        return np.array(path[:-1] if closed else path, dtype=np.int64)

    def joins(self, ids: Ids, closed: bool) -> bool:
        """Whether consecutive vertices ``(n,)`` are joined by edges already, as in most files."""
        pairs = np.sort(np.stack([ids, np.roll(ids, -1)], axis=1), axis=1)[: len(ids) if closed else len(ids) - 1]
        keys = pairs[:, 0] * len(self._vertices) + pairs[:, 1]
        found = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        return bool((self._keys[found] == keys).all())

    def _between(self, start: int, end: int) -> list[int]:
        """Vertices after ``start`` up to ``end``."""
        # Paths between picks are short: looking no farther than a few times their distance spares the whole mesh.
        reach = 3 * float(np.linalg.norm(self._vertices[start] - self._vertices[end]))
        for limit in (max(reach, 1e-12), np.inf):
            distance, before = dijkstra(self._graph, indices=start, return_predecessors=True, limit=limit)
            if np.isfinite(distance[end]):
                steps = [end]
                while before[steps[-1]] != start and steps[-1] != start:
                    steps.append(int(before[steps[-1]]))
                return steps[::-1]
        raise InputError(
            f"no path of edges joins vertices {start} and {end}",
            remedy="pick vertices of one connected part of the mesh",
        )


def shortest_edge_path(
    vertices: NDArray[np.float64], triangles: NDArray[np.integer], picks: Sequence[int] | Ids, closed: bool
) -> Ids:
    """Shortest path along edges through the picked vertices, in order; back to the first if ``closed``.

    Returns the ids ``(n,)``; a closed path does not repeat its first vertex.
    """
    return EdgePaths(vertices, triangles).through(picks, closed)


def trace_lines(
    lines: Sequence[FeatureLine], vertices: NDArray[np.float64], triangles: NDArray[np.integer]
) -> list[FeatureLine]:
    """The same lines with consecutive vertices joined along edges; lines that are paths already stay as they are."""
    paths = EdgePaths(vertices, triangles)
    return [
        line
        if paths.joins(line.vertices, line.closed)
        else replace(line, vertices=paths.through(line.vertices, line.closed))
        for line in lines
    ]


def line_edges(lines: Sequence[FeatureLine]) -> Ids:
    """All edges of all lines but the guides, each once, ``(E, 2)``, lower id first."""
    edges = [np.zeros((0, 2), dtype=np.int64)] + [line.edges() for line in lines if not line.guide]
    return np.unique(np.sort(np.concatenate(edges), axis=1), axis=0)


def find_openings(lines: Sequence[FeatureLine], vertices: NDArray[np.float64]) -> list[Opening]:
    """The openings whose sides can touch.

    Two open lines called ``..._upper`` and ``..._lower`` are the sides of one; otherwise a closed line round a lid or
    an inner lip is split at its corners, the two vertices of it that are farthest apart. Guides are no sides.
    """
    named = {line.name: line for line in lines if not line.guide}
    openings = []
    covered: set[int] = set()
    for name, line in named.items():
        partner = named.get(name.replace("upper", "lower"))
        if "upper" not in name or partner is None or line.closed or partner.closed or "outer" in name:
            continue
        upper, lower = line.vertices, partner.vertices
        if np.linalg.norm(vertices[upper[0]] - vertices[lower[0]]) > np.linalg.norm(
            vertices[upper[0]] - vertices[lower[-1]]
        ):
            lower = lower[::-1]
        openings.append(Opening(name.replace("_upper", "").replace("upper_", ""), upper, lower))
        covered.update(upper.tolist(), lower.tolist())
    for line in named.values():
        is_rim = any(word in line.name for word in _OPENING_WORDS) and "outer" not in line.name
        if not line.closed or not is_rim or len(covered.intersection(line.vertices.tolist())) > 2:
            continue
        # Which side is called the upper one does not matter to the contacts.
        openings.append(Opening(line.name, *halves(line.vertices, *corners_of(vertices[line.vertices]))))
    return openings


def corners_of(ring: NDArray[np.floating]) -> tuple[int, int]:
    """The two points of a closed line ``(n, 3)`` that are farthest apart, the earlier one first."""
    apart = np.linalg.norm(ring[:, None] - ring[None], axis=2)
    first, last = sorted(int(i) for i in np.unravel_index(np.argmax(apart), apart.shape))
    return first, last


def halves(ring: Ids, first: int, last: int) -> tuple[Ids, Ids]:
    """The two ways from ``ring[first]`` to ``ring[last]`` along a closed line ``(n,)``."""
    turned = np.roll(ring, -first)
    split = (last - first) % len(ring)
    return turned[: split + 1], np.append(turned[split:], turned[0])[::-1]


def load_feature_lines(path: str | Path, n_source: int | None = None, n_target: int | None = None) -> list[FeatureLine]:
    """Read ``{"lines": [{"name", "closed", "vertices", "target_vertices"?, "guide"?}]}`` (0-based ids)."""
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8-sig"))
        entries = data["lines"]
        lines = [_line_from(entry) for entry in entries]
    except FileNotFoundError:
        raise InputError("there is no such file", where=path, remedy="give the path of a feature_lines.json") from None
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"this is no feature-line file ({error!r})",
            where=path,
            remedy='it should read {"lines": [{"name": "upper_lip", "closed": false, "vertices": [17, 18, 40]}]}',
        ) from error
    for line in lines:
        _check_ids(line.name, line.vertices, n_source, "source", path)
        if line.target_vertices is not None:
            _check_ids(line.name, line.target_vertices, n_target, "target", path)
    return lines


def _line_from(entry: dict[str, Any]) -> FeatureLine:
    if not isinstance(entry, dict):
        raise ValueError(f"{entry} is no line")
    flags = {"closed": entry["closed"], "guide": entry.get("guide", False)}
    for key, value in flags.items():
        if not isinstance(value, bool):
            raise ValueError(f"{key} of the line {entry['name']!r} is {value!r}, neither true nor false")
    what, target = f"a vertex of the line {entry['name']!r}", entry.get("target_vertices")
    return FeatureLine(
        name=str(entry["name"]),
        vertices=vertex_ids(entry["vertices"], what),
        target_vertices=None if target is None else vertex_ids(target, what),
        **flags,
    )


def _check_ids(name: str, ids: Ids, count: int | None, side: str, path: str | Path) -> None:
    if len(ids) < 2:
        raise InputError(
            f"line {name!r} has {len(ids)} {side} vertices", where=path, remedy="pick at least two, or delete the line"
        )
    outside = ids[(ids < 0) | (ids >= (count if count is not None else np.inf))]
    if len(outside):
        raise InputError(
            f"line {name!r} refers to {side} vertex {outside[0]}, the mesh has {count} vertices, counted from 0",
            where=path,
            remedy="pick the line again on this mesh",
        )


def save_feature_lines(path: str | Path, lines: Sequence[FeatureLine]) -> None:
    """Write the lines so that `load_feature_lines` gives them back."""
    entries = []
    for line in lines:
        entry: dict[str, Any] = {"name": line.name, "closed": line.closed, "vertices": line.vertices.tolist()}
        if line.target_vertices is not None:
            entry["target_vertices"] = line.target_vertices.tolist()
        if line.guide:
            entry["guide"] = True
        entries.append(entry)
    text = json.dumps({"lines": entries}, indent=1)
    with written_aside(path) as temporary:
        Path(temporary).write_text(text + "\n", encoding="utf-8")
