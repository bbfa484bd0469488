"""Small writers for the samples' own files: always the same bytes for the same content."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["write_json", "write_obj", "write_ply"]


def write_json(path: Path, content: Any) -> None:
    """Write JSON with sorted keys, one line a list entry of the outer list."""
    path.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n", encoding="utf-8")


def write_ply(path: Path, vertices: NDArray[np.float32], triangles: NDArray[np.integer]) -> None:
    """Write a binary PLY of ``vertices`` (V, 3) float32 and ``triangles`` (F, 3)."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(triangles), dtype=[("n", "u1"), ("v", "<i4", (3,))])
    faces["n"], faces["v"] = 3, triangles
    path.write_bytes(header.encode("ascii") + vertices.astype("<f4").tobytes() + faces.tobytes())


def write_obj(path: Path, vertices: NDArray[np.floating], faces: NDArray[np.integer]) -> None:
    """Write an OBJ of ``vertices`` (V, 3) and ``faces`` (F, k), with as many digits as float32 holds."""
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices.tolist()]
    rows += ["f " + " ".join(map(str, face)) for face in (faces + 1).tolist()]
    path.write_text("\n".join(rows) + "\n", encoding="ascii")
