"""Compiled code, loaded before there is a window: compiling or loading it later would stop that for a moment."""

from __future__ import annotations

import numpy as np

from toolkit.rendering import Camera
from toolkit.rendering.text import font
from viewer import overlay, raycast, shading

__all__ = ["load_compiled"]


def load_compiled() -> None:
    """Run all of it once, on a triangle of the types that faces have."""
    corners, ids = np.eye(3, dtype=np.float32), np.arange(3, dtype=np.int32)[None]
    ahead = np.full((1, 3), 3**-0.5)
    raycast.first_hits(corners, ids, np.zeros(3), ahead, ahead[0])
    raycast.triangles_of_vertices(ids, len(corners))
    camera, out = Camera((0.0, 0.0, 9.0), (0.0, 0.0, 0.0)), np.empty_like(corners)
    shading.bake(corners, ids, out, shading.Light(), camera, out.copy(), out)
    edges = np.array([[0, 1]], np.int32)
    font(12)  # reads a typeface, by a library that takes a second to come up
    overlay.wires(corners, edges, camera, 100, np.empty((4, 3), np.float32))
