"""Several meshes of one scene as one mesh: USD and Alembic keep a face, its eyes and its teeth as objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio.faces import build_mesh

__all__ = ["Piece", "frame_rate_of", "join_faces", "join_points", "reverse_faces", "transform_points"]


@dataclass(frozen=True)
class Piece:
    """One object of a scene: its name for messages, ``points`` (V, 3) in world space, its faces."""

    name: str
    points: NDArray[np.floating]
    counts: NDArray[np.integer]
    indices: NDArray[np.integer]


def join_faces(pieces: list[Piece], where: object) -> TriangleMesh:
    """Join the pieces to one mesh, vertices and faces in the order of the pieces."""
    offset, counts, indices = 0, [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for piece in pieces:
        ids = np.asarray(piece.indices, dtype=np.int64)
        _check_piece(piece, ids, where)
        counts.append(np.asarray(piece.counts, dtype=np.int64))
        indices.append(ids + offset)
        offset += len(piece.points)
    points = np.concatenate([np.zeros((0, 3)), *[piece.points for piece in pieces]])
    return build_mesh(points, np.concatenate(counts), np.concatenate(indices), where=where)


def join_points(
    names: list[str], blocks: list[NDArray[np.floating]], sizes: list[int], frame: int, where: object
) -> NDArray[np.floating]:
    """Join one frame's points ``(V, 3)``; each object must have the vertices that it has in the first frame."""
    for name, block, size in zip(names, blocks, sizes, strict=True):
        if len(block) != size:
            what = f"{name} has {len(block)} vertices in frame {frame}, but {size} in frame 0"
            raise InputError(what, where=where, remedy="export the take with a fixed topology")
    return np.concatenate(blocks)


def reverse_faces(counts: NDArray[np.integer], indices: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the corners of every face in the opposite order: the other winding, and its own inverse."""
    n = np.asarray(counts, dtype=np.int64)
    first = np.repeat(np.cumsum(n) - n, n)
    within = np.arange(n.sum()) - first
    return np.asarray(indices, dtype=np.int64)[first + np.repeat(n, n) - 1 - within]


def transform_points(points: NDArray[np.floating], row_matrix: NDArray[np.float64]) -> NDArray[np.floating]:
    """Apply a 4 x 4 matrix of the row-vector convention (``p M``); an identity leaves the bits alone."""
    if np.array_equal(row_matrix, np.eye(4)):
        return points
    return points.astype(np.float64) @ row_matrix[:3, :3] + row_matrix[3, :3]


def frame_rate_of(times: NDArray[np.float64]) -> float | None:
    """Return the mean rate of the frame ``times`` (T,) in seconds, to 3 decimals; None where they span nothing."""
    span = float(times[-1] - times[0])
    return round((len(times) - 1) / span, 3) if 0 < span < np.inf else None


def _check_piece(piece: Piece, ids: NDArray[np.int64], where: object) -> None:
    total, n_vertices = int(np.sum(piece.counts)), len(piece.points)
    if total != len(ids):
        what = f"{piece.name} has faces of {total} corners in all, but {len(ids)} vertex ids"
        raise InputError(what, where=where, remedy="the file is damaged, export it again")
    if len(ids) and not 0 <= ids.min() <= ids.max() < n_vertices:
        wrong = ids.max() if ids.max() >= n_vertices else ids.min()
        what = f"{piece.name} uses vertex {wrong} (counted from 0), but has {n_vertices} vertices"
        raise InputError(what, where=where, remedy="the file is damaged, export it again")
