"""Checks of a take against its reference, frame by frame, without holding it in memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from toolkit.checks.edges import edge_table
from toolkit.checks.findings import Finding, and_more
from toolkit.checks.measures import squared_lengths
from toolkit.checks.scale import unit_guess
from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio.sequence import FrameSequence
from toolkit.progress import Progress, silent

__all__ = ["check_pair", "check_sequence"]

SIZE_RANGE = (0.5, 2.0)
"""A face neither halves nor doubles in a take: outside of this, the unit or the data is wrong."""

TORN_SHARE = 0.01
"""This share of torn edges means another vertex order, not an odd frame."""

_SAMPLED = 4096
"""Vertices that a frame's size is taken from."""


def check_pair(reference: TriangleMesh, sequence: FrameSequence, where: object = "") -> list[Finding]:
    """Check that the reference is in the take's topology: the count, and from sampled frames the order, of vertices.

    Another order shows in the reference's edges: drawn on a frame, they run right across the face.
    """
    if sequence.n_vertices != reference.n_vertices:
        what = f"the reference has {reference.n_vertices} vertices, the frames have {sequence.n_vertices}"
        return [Finding("error", _named(what, where), sequence.where, None, _TOPOLOGY)]
    edges = edge_table(reference.triangles, reference.n_vertices).edges
    if len(edges) == 0:
        return []
    rest = _relative_lengths(reference.vertices, edges)
    for frame in _spread(sequence.n_frames, 5):
        positions = sequence.read(frame, frame + 1)[0].astype(np.float64)
        if not np.isfinite(positions).all() or _size(positions) == 0:
            continue  # check_sequence says this better
        torn = _torn(rest, _relative_lengths(positions, edges))
        if torn.mean() > TORN_SHARE:
            i, j = edges[np.argmax(torn)]
            what = (
                f"in frame {frame} {100 * torn.mean():.0f} % of the reference's edges run across the face, "
                f"e.g. from vertex {i} to {j}: the vertices are in another order"
            )
            return [Finding("error", _named(what, where), sequence.where, int(frame), _TOPOLOGY)]
    return []


def _relative_lengths(positions: NDArray[np.float64], edges: NDArray[np.integer]) -> NDArray[np.float64]:
    """Squared lengths ``(E,)`` of the edges in units of the face's size."""
    return np.asarray(squared_lengths(positions, edges) / _size(positions) ** 2)


def _torn(rest: NDArray[np.float64], moved: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mask ``(E,)`` of the edges that are ten times as long as in the reference, and long beside the face.

    From squared lengths beside the face's size. The second condition spares the small edges at the corner of a mouth
    that opens.
    """
    return np.asarray(moved > np.maximum(100 * rest, 0.01))


def check_sequence(
    sequence: FrameSequence, reference: TriangleMesh, where: object = "", progress: Progress = silent
) -> list[Finding]:
    """Read every frame once and check it: finite coordinates, the vertex count, the size beside the reference's.

    Frames of another size are only judged where the vertex count is the reference's.
    """
    place = str(where or sequence.where)
    faulty = _NonFinite(place)
    sizes = np.full(sequence.n_frames, np.nan)
    try:
        for start, stop in sequence.blocks():
            block = sequence.view(start, stop)
            faulty.look(block, start)
            sizes[start:stop] = _sizes(block)
            progress("checking frames", stop, sequence.n_frames)
    except InputError as error:  # a frame that cannot be read: another vertex count, a torn file
        return [*faulty.findings(), Finding("error", error.what, error.where, None, error.remedy)]
    findings = faulty.findings()
    if sequence.n_vertices == reference.n_vertices:
        findings += _wrong_sizes(sizes, _size(reference.vertices), place)
    return findings


class _NonFinite:
    """Collects the frames with non-finite coordinates, and where the first one is."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.frames = 0
        self.first: tuple[int, int, int] | None = None

    def look(self, block: NDArray[np.float32], start: int) -> None:
        """Take in frames (B, V, 3) from ``start`` on."""
        # One non-finite number makes the sum non-finite; only then is it worth looking for.
        with np.errstate(over="ignore", invalid="ignore"):
            suspects = np.flatnonzero(~np.isfinite(block.sum(axis=(1, 2))))
        for frame in suspects:
            broken = np.flatnonzero(~np.isfinite(block[frame]).all(axis=1))
            if len(broken):
                self.frames += 1
                self.first = self.first or (start + int(frame), int(broken[0]), len(broken))

    def findings(self) -> list[Finding]:
        """One finding for all frames that were seen, if any is broken."""
        if self.first is None:
            return []
        frame, vertex, count = self.first
        what = f"frame {frame}: vertex {vertex} has no finite position{and_more(count)}"
        if self.frames > 1:
            what += f"; {self.frames} frames are affected"
        return [Finding("error", what, self.where, frame, "mend those frames or leave them out")]


def _wrong_sizes(sizes: NDArray[np.float64], reference: float, where: str) -> list[Finding]:
    """Frames that are not the reference's size; the non-finite ones are said elsewhere."""
    ratio = sizes[np.isfinite(sizes)] / reference
    frames = np.flatnonzero(np.isfinite(sizes))
    wrong = (ratio < SIZE_RANGE[0]) | (ratio > SIZE_RANGE[1])
    if not wrong.any():
        return []
    first, share = int(frames[np.argmax(wrong)]), float(ratio[np.argmax(wrong)])
    if share == 0:
        what = f"frame {first}: all vertices lie at one point{and_more(int(np.count_nonzero(wrong)))}"
        return [Finding("error", what, where, first, "mend those frames or leave them out")]
    if wrong.all():
        typical = float(np.median(ratio))
        what = f"the frames are {typical:.3g} times the size of the reference{unit_guess(typical)}"
        return [Finding("error", what, where, first, "export the reference and the frames in the same unit")]
    what = f"frame {first} is {share:.3g} times the size of the reference{and_more(int(np.count_nonzero(wrong)))}"
    return [Finding("error", what, where, first, "mend those frames or leave them out")]


def _sizes(block: NDArray[np.floating]) -> NDArray[np.float64]:
    """Root mean square distance from the middle, ``(t,)``; unlike a bounding box it stays as a head turns.

    Of every n-th vertex: a size needs no more, and checking stays as quick as reading.
    """
    x = block[:, :: max(1, block.shape[1] // _SAMPLED)].astype(np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        x -= x.mean(axis=1, keepdims=True)
        return np.sqrt((x * x).sum(axis=2).mean(axis=1))


def _size(positions: NDArray[np.float64]) -> float:
    return float(_sizes(positions[None])[0])


def _spread(n: int, count: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, n - 1, count).round().astype(np.int64))


def _named(what: str, where: object) -> str:
    return f"{what} (reference: {where})" if where else what


_TOPOLOGY = "take the reference from the take itself, e.g. its most neutral frame, or export both with one vertex order"
