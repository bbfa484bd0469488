"""Vertices that a program split along seams of textures or normals: one point of the skin, several ids.

Solvers and filters see a cut there. A target is joined again, its topology being free; a source cannot be, as its ids
are the take's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from toolkit.checks.edges import edge_table
from toolkit.checks.findings import Finding
from toolkit.checks.repair import Repair, said
from toolkit.feature_lines import FeatureLine
from toolkit.mesh import TriangleMesh
from toolkit.meshio.sequence import FrameSequence

__all__ = ["check_source_seams", "join_seams", "seam_copies"]

Ids = NDArray[np.int64]

_LOOKED_AT = 5
"""Frames that tell a seam from lips which are closed at rest: seams stay together in all of them."""


def seam_copies(mesh: TriangleMesh, keep_open: Sequence[FeatureLine] = ()) -> Ids:
    """For every vertex the first one at its place along a seam, ``(V,)``; itself where there is no seam.

    A seam is where two border edges lie on each other, to the last bit. ``keep_open`` are rims of lids and lips on
    this mesh: closed at rest, a mask's lips look like a seam, and edges that most of a rim runs along are none.
    """
    edges = edge_table(mesh.triangles, mesh.n_vertices).border
    used = np.unique(edges)
    _, place = np.unique(mesh.vertices[used], axis=0, return_inverse=True)
    places = np.zeros(mesh.n_vertices, dtype=np.int64)
    places[used] = place.reshape(-1)
    ends = np.sort(places[edges], axis=1)
    _, which, times = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    on_seam = (times[which.reshape(-1)] == 2) & (ends[:, 0] != ends[:, 1])
    chains = _chains(ends[on_seam], int(places.max(initial=0)) + 1)
    copies = np.arange(mesh.n_vertices, dtype=np.int64)
    seam = np.unique(edges[on_seam])
    open_chains = [_chain_along(line.vertices, seam, chains[places[seam]]) for line in keep_open]
    seam = seam[~np.isin(chains[places[seam]], open_chains)]
    _, first, group = np.unique(places[seam], return_index=True, return_inverse=True)
    copies[seam] = seam[first][group]
    return copies


def join_seams(target: TriangleMesh, keep_open: Sequence[FeatureLine], where: object = "") -> Repair:
    """A target with one vertex at each place along its seams; ``keep_open`` as in `seam_copies`."""
    copies = seam_copies(target, keep_open)
    kept, new = np.unique(copies, return_inverse=True)
    new = new.reshape(-1).astype(np.int64)
    count = target.n_vertices - len(kept)
    if count == 0:
        return Repair(target, new, ())
    joined = TriangleMesh(target.vertices[kept], new[target.triangles].astype(np.int32))
    return said(Repair(joined, new, (f"joined {count} vertices that were split along seams",)), where)


def check_source_seams(source: TriangleMesh, sequence: FrameSequence, where: str) -> list[Finding]:
    """An error where the source's vertices are split along seams, and stay together in the take."""
    copies = seam_copies(source)
    twins = np.flatnonzero(copies != np.arange(source.n_vertices))
    for frame in np.unique(np.linspace(0, sequence.n_frames - 1, _LOOKED_AT).round().astype(int)):
        if len(twins):
            positions = sequence.read(frame, frame + 1)[0]
            twins = twins[(positions[twins] == positions[copies[twins]]).all(axis=1)]
    if len(twins) == 0:
        return []
    pair = f"{copies[twins[0]]} and {twins[0]}"
    what = f"{len(twins)} vertices are split along seams, e.g. {pair}, and the skin would tear there"
    remedy = "merge vertices by distance and export reference and take again; glTF: without textures and normals"
    return [Finding("error", what, where, int(twins[0]), remedy)]


def _chains(ends: Ids, n_places: int) -> Ids:
    """Label ``(n_places,)`` of the connected chain of seam edges ``(E, 2)`` at each place."""
    shape = (n_places, n_places)
    graph = sp.csr_matrix((np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=shape)
    labels: Ids = connected_components(graph, directed=False)[1].astype(np.int64)
    return labels


def _chain_along(line: Ids, seam: Ids, chains: Ids) -> int:
    """The chain on which most of a line's vertices lie, -1 if none; ``chains`` (n,) are those of ``seam`` (n,)."""
    found = chains[np.isin(seam, line)]
    if len(found) == 0:
        return -1
    labels, counts = np.unique(found, return_counts=True)
    return int(labels[np.argmax(counts)]) if counts.max() > len(line) / 2 else -1
