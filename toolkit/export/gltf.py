"""glTF: the rest mesh, the bases as morph targets, their weights and the head's motion as an animation.

Never baked frames: a viewer plays K shapes and T weights of each, which is small. So the file shows what the bases
span, and the writer measures how far that is from the exact frames.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from toolkit.export.performance import Performance
from toolkit.mesh import vertex_normals
from toolkit.meshio.aside import written_aside
from toolkit.progress import Progress

__all__ = ["morph_deviation", "write_glb"]

_FLOAT, _UINT32 = 5126, 5125
_VERTEX_DATA, _INDEX_DATA = 34962, 34963
_MATERIAL = {
    "name": "skin",
    "pbrMetallicRoughness": {"baseColorFactor": [0.72, 0.62, 0.56, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6},
    "doubleSided": True,
}


def write_glb(performance: Performance, path: Path, progress: Progress) -> tuple[float, float]:
    """Write a ``.glb`` and return the RMS and the largest deviation of its frames from the exact ones."""
    builder = _Builder()
    mesh = _mesh(builder, performance)
    nodes: list[dict[str, Any]] = [{"name": performance.name, "mesh": 0}]
    if performance.metres_per_unit is not None:
        nodes.append({"name": "metres", "scale": [performance.metres_per_unit] * 3, "children": [0]})
    animation = _animation(builder, performance)
    document = {
        "asset": {"version": "2.0", "generator": "Mien"},
        "scene": 0,
        "scenes": [{"nodes": [len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": [mesh],
        "materials": [_MATERIAL],
        "accessors": builder.accessors,
        "bufferViews": builder.views,
        "buffers": [{"byteLength": builder.n_bytes}],
    }
    if animation["channels"]:
        document["animations"] = [animation]
    with written_aside(path) as temporary:
        temporary.write_bytes(_container(document, builder.chunks))
    return morph_deviation(performance, progress)


def morph_deviation(performance: Performance, progress: Progress) -> tuple[float, float]:
    """RMS and largest distance, over vertices, of ``R_t (rest + sum_k w_tk delta_k) + t_t`` from the exact frames."""
    rest = performance.rest
    deltas = (performance.morphs - rest).reshape(len(performance.morphs), rest.size)
    total, largest = 0.0, 0.0
    for start, stop in performance.blocks():
        shapes = rest + (performance.weights[start:stop] @ deltas).reshape(stop - start, -1, 3)
        moved = shapes @ performance.rotations[start:stop].swapaxes(1, 2)
        moved += performance.translations[start:stop, None]
        squared = np.sum((moved - performance.read(start, stop)) ** 2, axis=2, dtype=np.float64)
        total, largest = total + float(squared.sum()), max(largest, float(squared.max()))
        progress("measuring what the morph targets leave out", stop, performance.n_frames)
    return float(np.sqrt(total / (performance.n_frames * performance.n_vertices))), float(np.sqrt(largest))


class _Builder:
    """Collects arrays as accessors, each in a buffer view of its own."""

    def __init__(self) -> None:
        self.accessors: list[dict[str, Any]] = []
        self.views: list[dict[str, Any]] = []
        self.chunks: list[bytes] = []
        self.n_bytes = 0

    def add(self, values: NDArray, kind: str, *, target: int | None = None, bounds: bool = False) -> int:
        """Add an array ``(N,)`` or ``(N, C)`` and return its accessor."""
        data = np.ascontiguousarray(values, dtype="<u4" if values.dtype.kind in "iu" else "<f4")
        view = {"buffer": 0, "byteOffset": self.n_bytes, "byteLength": data.nbytes}
        accessor = {"bufferView": len(self.views), "componentType": _FLOAT, "count": len(data), "type": kind}
        if data.dtype.kind == "u":
            accessor["componentType"] = _UINT32
        if target is not None:
            view["target"] = target
        if bounds:
            table = data.reshape(len(data), -1)
            accessor |= {"min": table.min(axis=0).tolist(), "max": table.max(axis=0).tolist()}
        self.views.append(view)
        self.accessors.append(accessor)
        self.chunks.append(data.tobytes())
        self.n_bytes += data.nbytes
        return len(self.accessors) - 1


def _mesh(builder: _Builder, performance: Performance) -> dict[str, Any]:
    """Rest positions and normals, and their differences in each basis: without normals, wrinkles would not shade."""
    rest = np.asarray(performance.rest, dtype=np.float64)
    normals = _unit_normals(rest, performance.triangles)
    attributes = {
        "POSITION": builder.add(rest, "VEC3", target=_VERTEX_DATA, bounds=True),
        "NORMAL": builder.add(normals, "VEC3", target=_VERTEX_DATA),
    }
    targets = []
    for shape in performance.morphs:
        deltas = {"POSITION": shape - rest, "NORMAL": _unit_normals(shape, performance.triangles) - normals}
        targets.append(
            {name: builder.add(d, "VEC3", target=_VERTEX_DATA, bounds=name == "POSITION") for name, d in deltas.items()}
        )
    primitive: dict[str, Any] = {"attributes": attributes, "material": 0, "mode": 4}
    primitive["indices"] = builder.add(performance.triangles.ravel(), "SCALAR", target=_INDEX_DATA)
    mesh: dict[str, Any] = {"name": performance.name, "primitives": [primitive]}
    if targets:
        primitive["targets"] = targets
        mesh["weights"] = [0.0] * len(targets)
        mesh["extras"] = {"targetNames": performance.names_of_morphs()}
    return mesh


def _unit_normals(vertices: NDArray[np.floating], triangles: NDArray[np.integer]) -> NDArray[np.float64]:
    normals = vertex_normals(np.asarray(vertices, dtype=np.float64), triangles)
    normals[np.linalg.norm(normals, axis=1) < 0.5] = (0.0, 0.0, 1.0)  # lone vertices: the format wants unit normals
    return normals


def _animation(builder: _Builder, performance: Performance) -> dict[str, Any]:
    """Weights and head motion with linear keys at every frame; a motion that is none is left out."""
    curves: dict[str, int] = {}
    if len(performance.morphs):
        curves["weights"] = builder.add(performance.weights.ravel(), "SCALAR")
    if not np.allclose(performance.rotations, np.eye(3), rtol=0, atol=1e-12):
        curves["rotation"] = builder.add(_continuous_quaternions(performance.rotations), "VEC4")
    if performance.translations.any():
        curves["translation"] = builder.add(performance.translations, "VEC3")
    if not curves:
        return {"samplers": [], "channels": []}
    times = builder.add(np.arange(performance.n_frames) / performance.fps, "SCALAR", bounds=True)
    return {
        "name": performance.name,
        "samplers": [{"input": times, "output": output, "interpolation": "LINEAR"} for output in curves.values()],
        "channels": [{"sampler": i, "target": {"node": 0, "path": path}} for i, path in enumerate(curves)],
    }


def _continuous_quaternions(rotations: NDArray[np.floating]) -> NDArray[np.float64]:
    """Quaternions ``(T, 4)`` (x, y, z, w), each on the same side as the one before: q and -q are one rotation."""
    quaternions = Rotation.from_matrix(rotations).as_quat()
    flips = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0
    signs = np.cumprod(np.concatenate([[1.0], np.where(flips, -1.0, 1.0)]))
    return quaternions * signs[:, None]


def _container(document: dict[str, Any], chunks: list[bytes]) -> bytes:
    """Pack a GLB: header, JSON chunk padded with blanks, binary chunk (its arrays are whole words)."""
    text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    binary = b"".join(chunks)
    length = 12 + 8 + len(text) + 8 + len(binary)
    head = struct.pack("<4sII", b"glTF", 2, length) + struct.pack("<I4s", len(text), b"JSON")
    return b"".join([head, text, struct.pack("<I4s", len(binary), b"BIN\0"), binary])
