#!/usr/bin/env python3
"""What the viewer itself does for one frame of playback: two faces lit, put into buffers, the time line drawn.

Without the renderer, so without a display: the same calls as `viewer.view.pane`, on a made head. Prints the time a
frame, and how much memory grew over a longer play. Issue 5 asks for at most 15 ms with two faces of 80,000 vertices.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from viewer import overlay, shading, timeline  # noqa: E402
from viewer.state.cameras import Framing, Viewpoint  # noqa: E402
from viewer.state.marks import Curve, Disc  # noqa: E402

RING = 3


def head(n_vertices: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """A ball of about ``n_vertices`` with ripples, as quads split in two."""
    columns = int(np.sqrt(2 * n_vertices))
    rows = n_vertices // columns
    polar, turn = np.meshgrid(np.linspace(0.1, 3.0, rows), np.linspace(0, 2 * np.pi, columns), indexing="ij")
    radius = 1 + 0.01 * np.sin(60 * polar) * np.cos(40 * turn)
    points = np.stack([np.sin(polar) * np.sin(turn), np.cos(polar), np.sin(polar) * np.cos(turn)], axis=-1)
    ids = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (ids[:-1, :-1], ids[1:, :-1], ids[1:, 1:], ids[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return (points * radius[..., None]).reshape(-1, 3).astype(np.float32), triangles


class Faces:
    """Two faces and their buffers, as the panes hold them."""

    def __init__(self, vertices: NDArray[np.float32], triangles: NDArray[np.int32]) -> None:
        self.frames = [vertices * np.float32(1 + 0.001 * k) for k in range(8)]
        self.triangles = triangles
        shape = (2, RING, len(vertices), 3)
        self.positions, self.colors = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
        self.normals = np.zeros(vertices.shape, np.float32)
        self.camera = Viewpoint().camera(Framing.of(vertices))
        self.base = np.array([shading.SKIN], np.float32)
        edge = vertices[np.arange(0, len(vertices), len(vertices) // 80)].astype(np.float64)
        self.marks = [Disc(tuple(p)) for p in edge[:50].tolist()] + [Curve(edge)]

    def draw(self, turn: int) -> None:
        """Both faces."""
        for pane in (0, 1):
            positions, colors = self.positions[pane, turn % RING], self.colors[pane, turn % RING]
            positions[:] = self.frames[turn % len(self.frames)]
            shading.bake(positions, self.triangles, self.base, shading.Light(), self.camera, self.normals, colors)
            overlay.build(self.marks, self.camera, 700)


def measure(n_vertices: int, seconds: float) -> dict[str, float]:
    """Best and median of the frames, and the growth of memory in MB."""
    vertices, triangles = head(n_vertices)
    faces = Faces(vertices, triangles)
    layout = timeline.Layout(1100, 112, 1300)
    drawer = timeline.Drawer()
    curve = np.abs(np.sin(np.linspace(0, 20, 1300)))
    for turn in range(10):
        faces.draw(turn)
        drawer.draw(layout, timeline.Timeline(turn, 30.0, (100, 300), (), curve, 1.1 * curve, "basis 1"))
    before = _resident()
    taken, drawn, turn = [], [], 0
    until = time.perf_counter() + seconds
    while time.perf_counter() < until or turn < 30:
        began = time.process_time()
        faces.draw(turn)
        middle = time.process_time()
        drawer.draw(layout, timeline.Timeline(turn % 1300, 30.0, (100, 300), (), curve, 1.1 * curve, "basis 1"))
        taken.append(time.process_time() - began)
        drawn.append(time.process_time() - middle)
        turn += 1
    return {
        "vertices": float(len(vertices)),
        "frame_ms": 1e3 * float(np.min(taken)),
        "frame_median_ms": 1e3 * float(np.median(taken)),
        "timeline_ms": 1e3 * float(np.min(drawn)),
        "frames": float(turn),
        "growth_mb": _resident() - before,
    }


def _resident() -> float:
    """Resident memory in MB; the peak where /proc is not there."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * resource.getpagesize() / 2**20
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, default=80_000, help="of each of the two faces")
    parser.add_argument("--seconds", type=float, default=5.0, help="how long to play (600 for the growth of memory)")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON")
    options = parser.parse_args()
    result = measure(options.vertices, options.seconds)
    print(f"two faces of {result['vertices']:.0f} vertices, CPU time of this code a frame")
    print(f"  best   {result['frame_ms']:.1f} ms (of it the time line {result['timeline_ms']:.1f} ms)")
    print(f"  median {result['frame_median_ms']:.1f} ms")
    print(f"  memory grew by {result['growth_mb']:.1f} MB in {result['frames']:.0f} frames")
    if options.json:
        print(json.dumps(result))
    return 0


if __name__ == "__main__":
    sys.exit(main())
