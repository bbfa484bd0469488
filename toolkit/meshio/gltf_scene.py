"""The meshes of a glTF scene, joined: node transforms, morph targets and skins evaluated for a pose."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.meshio.gltf_file import GltfFile

__all__ = ["GltfScene", "Pose"]

Array = NDArray[np.float64]
Pose = Mapping[tuple[int, str], Array]
"""What an animation sets at one time: (node, "translation" | "rotation" | "scale" | "weights") -> value."""

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True)
class _Part:
    """The vertices of one node that share their attributes, with all triangles that use them."""

    node: int
    positions: Array
    targets: list[Array | None]
    triangles: NDArray[np.int64]
    skin: _Skin | None


@dataclass(frozen=True)
class _Skin:
    joint_nodes: list[int]
    inverse_bind: Array
    joints: NDArray[np.int64]
    weights: Array


class GltfScene:
    """All triangle meshes of the default scene, as one: vertices and faces in the order of nodes and primitives."""

    def __init__(self, file: GltfFile) -> None:
        self._nodes = file.items("nodes")
        self._meshes = file.items("meshes")
        self._parents = {child: i for i, node in enumerate(self._nodes) for child in node.get("children", [])}
        self._parts = [part for node in self._mesh_nodes(file.document) for part in self._parts_of(file, node)]

    @property
    def influences(self) -> set[int]:
        """Nodes whose animation moves a vertex: the mesh nodes, the joints, and their ancestors."""
        seeds = {part.node for part in self._parts}
        seeds |= {joint for part in self._parts if part.skin for joint in part.skin.joint_nodes}
        return {ancestor for seed in seeds for ancestor in self._chain(seed)}

    def faces(self) -> NDArray[np.int64]:
        """Triangles ``(F, 3)`` of the joined mesh; a mirroring node turns the winding, as the specification says."""
        blocks, offset = [np.zeros((0, 3), dtype=np.int64)], 0
        for part in self._parts:
            mirrored = part.skin is None and np.linalg.det(self._world(part.node, {})[:3, :3]) < 0
            triangles = part.triangles[:, ::-1] if mirrored else part.triangles
            # An index beyond its own part stays out of range of the joined mesh, so that the reader reports it.
            blocks.append(np.where(triangles < len(part.positions), triangles + offset, np.iinfo(np.int32).max))
            offset += len(part.positions)
        return np.concatenate(blocks)

    def vertices(self, pose: Pose) -> Array:
        """World positions ``(V, 3)`` in this pose; what the pose does not set keeps the file's value."""
        blocks = [np.zeros((0, 3))]
        for part in self._parts:
            local = self._morphed(part, pose)
            if part.skin is None:
                blocks.append(_transformed(self._world(part.node, pose), local))
            else:
                blocks.append(self._skinned(part.skin, local, pose))
        return np.concatenate(blocks)

    def _mesh_nodes(self, document: dict[str, Any]) -> Iterator[int]:
        scenes = document.get("scenes", [])
        roots = [i for i in range(len(self._nodes)) if i not in self._parents]
        stack = list(scenes[document.get("scene", 0)].get("nodes", []) if scenes else roots)[::-1]
        while stack:
            node = stack.pop()
            if "mesh" in self._nodes[node]:
                yield node
            stack.extend(self._nodes[node].get("children", [])[::-1])

    def _parts_of(self, file: GltfFile, node: int) -> list[_Part]:
        """Primitives that share their vertices (one a material) become one part, so no vertex comes twice."""
        groups: dict[tuple[int, tuple[int | None, ...]], list[dict[str, Any]]] = {}
        for primitive in self._meshes[self._nodes[node]["mesh"]]["primitives"]:
            mode = primitive.get("mode", _TRIANGLES)
            if mode in (_TRIANGLES, _STRIP, _FAN) and "POSITION" in primitive["attributes"]:
                targets = tuple(target.get("POSITION") for target in primitive.get("targets", []))
                groups.setdefault((primitive["attributes"]["POSITION"], targets), []).append(primitive)
        return [self._part(file, node, *key, members) for key, members in groups.items()]

    def _part(
        self,
        file: GltfFile,
        node: int,
        position: int,
        targets: tuple[int | None, ...],
        primitives: list[dict[str, Any]],
    ) -> _Part:
        positions = file.accessor(position).astype(np.float64)
        triangles = np.concatenate([_triangles(file, primitive, len(positions)) for primitive in primitives])
        deltas = [None if target is None else file.accessor(target).astype(np.float64) for target in targets]
        skin = None
        if "skin" in self._nodes[node] and "JOINTS_0" in primitives[0]["attributes"]:
            skin = _read_skin(file, self._nodes[node]["skin"], primitives[0]["attributes"])
        return _Part(node, positions, deltas, triangles, skin)

    def _morphed(self, part: _Part, pose: Pose) -> Array:
        if not part.targets:
            return part.positions
        node = self._nodes[part.node]
        default = node.get("weights", self._meshes[node["mesh"]].get("weights", [0.0] * len(part.targets)))
        weights = pose.get((part.node, "weights"), np.asarray(default, dtype=np.float64))
        moved = part.positions.copy()
        for weight, delta in zip(weights, part.targets, strict=False):
            if weight and delta is not None:
                moved += weight * delta
        return moved

    def _skinned(self, skin: _Skin, local: Array, pose: Pose) -> Array:
        """Linear blend skinning; the mesh node's own transform does not count, as the specification says."""
        matrices = np.stack([self._world(joint, pose) for joint in skin.joint_nodes]) @ skin.inverse_bind
        result = np.zeros_like(local)
        for joints, weights in zip(skin.joints.T, skin.weights.T, strict=True):
            chosen = matrices[joints]
            result += weights[:, None] * (np.einsum("vij,vj->vi", chosen[:, :3, :3], local) + chosen[:, :3, 3])
        return result

    def _chain(self, node: int) -> Iterator[int]:
        current: int | None = node
        while current is not None:
            yield current
            current = self._parents.get(current)

    def _world(self, node: int, pose: Pose) -> Array:
        world = np.eye(4)
        for current in self._chain(node):
            world = _local_matrix(self._nodes[current], current, pose) @ world
        return world


def _triangles(file: GltfFile, primitive: dict[str, Any], n_vertices: int) -> NDArray[np.int64]:
    indices = file.accessor(primitive["indices"]) if "indices" in primitive else np.arange(n_vertices)
    indices = indices.astype(np.int64)
    mode = primitive.get("mode", _TRIANGLES)
    if mode == _TRIANGLES:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    k = np.arange(max(len(indices) - 2, 0))
    if mode == _FAN:
        return np.stack([indices[k + 1], indices[k + 2], indices[np.zeros_like(k)]], axis=1)
    odd = k % 2
    return np.stack([indices[k], indices[k + 1 + odd], indices[k + 2 - odd]], axis=1)


def _read_skin(file: GltfFile, index: int, attributes: dict[str, int]) -> _Skin:
    skin = file.items("skins")[index]
    sets = [n for n in range(8) if f"JOINTS_{n}" in attributes]
    joints = np.concatenate([file.accessor(attributes[f"JOINTS_{n}"]) for n in sets], axis=1).astype(np.int64)
    weights = np.concatenate([file.accessor(attributes[f"WEIGHTS_{n}"]) for n in sets], axis=1).astype(np.float64)
    inverse_bind = np.broadcast_to(np.eye(4), (len(skin["joints"]), 4, 4))
    if "inverseBindMatrices" in skin:
        columns_first = file.accessor(skin["inverseBindMatrices"]).astype(np.float64)
        inverse_bind = columns_first.reshape(-1, 4, 4).swapaxes(1, 2)
    return _Skin(list(skin["joints"]), inverse_bind, joints, weights)


def _local_matrix(node: dict[str, Any], index: int, pose: Pose) -> Array:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T

    def value(path: str, default: list[float]) -> Array:
        return pose.get((index, path), np.array(node.get(path, default), dtype=np.float64))

    matrix = np.eye(4)
    matrix[:3, :3] = _rotation_matrix(value("rotation", [0, 0, 0, 1])) * value("scale", [1, 1, 1])
    matrix[:3, 3] = value("translation", [0, 0, 0])
    return matrix


def _rotation_matrix(quaternion: Array) -> Array:
    x, y, z, w = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _transformed(matrix: Array, points: Array) -> Array:
    if np.array_equal(matrix, np.eye(4)):
        return points
    return points @ matrix[:3, :3].T + matrix[:3, 3]
