"""glTF 2.0 and GLB: the scene's meshes joined, and the animation of morph targets, nodes and skins as a take."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio.faces import build_mesh
from toolkit.meshio.gltf_animation import moving_clip
from toolkit.meshio.gltf_file import GltfFile
from toolkit.meshio.gltf_scene import GltfScene
from toolkit.meshio.sequence import FrameSequence

__all__ = ["open_gltf", "read_gltf"]


def read_gltf(path: str | Path) -> TriangleMesh:
    """Read the default scene at rest: every mesh, with its node's transform, joined in the order of the nodes.

    Vertices are the file's ``POSITION`` rows. Programs that write glTF split vertices at texture seams and hard
    edges, so the ids are the file's, not those of the model it came from.
    """
    with _sound_document(path):
        return _mesh(GltfScene(GltfFile(path)), path)


def open_gltf(path: Path, fps: float | None) -> FrameSequence:
    """Open the first animation that moves a mesh, sampled at ``fps`` (by default the rate its keys lie on)."""
    with _sound_document(path):
        file = GltfFile(path)
        scene = GltfScene(file)
        mesh = _mesh(scene, path)
        clip = moving_clip(file, scene.influences)
    rate = fps or clip.frame_rate()
    n_frames = int(np.floor(clip.duration * rate + 0.01)) + 1

    def read_block(start: int, stop: int) -> NDArray[np.float32]:
        block = np.zeros((stop - start, mesh.n_vertices, 3), dtype=np.float32)
        for row, frame in enumerate(range(start, stop)):
            block[row] = scene.vertices(clip.pose(clip.start + frame / rate))
        return block

    return FrameSequence(n_frames, mesh.n_vertices, rate, str(path), read_block, mesh.triangles)


@contextmanager
def _sound_document(path: str | Path) -> Iterator[None]:
    """Turn what a document with missing or wrong entries raises into a sentence."""
    try:
        yield
    except (AttributeError, IndexError, KeyError, TypeError) as error:
        what = f"the document does not hold together ({type(error).__name__}: {error})"
        raise InputError(what, where=path, remedy="it is damaged, export it again") from error


def _mesh(scene: GltfScene, path: str | Path) -> TriangleMesh:
    faces = scene.faces()
    return build_mesh(scene.vertices({}), np.full(len(faces), 3), faces.ravel(), where=path)
