"""A good mesh with borders and parts, from which the tests make ugly ones."""

from __future__ import annotations

import numpy as np
import pytest

from toolkit.mesh import TriangleMesh


def sphere(n_rings: int = 12, n_sectors: int = 20, open_bottom: bool = False) -> TriangleMesh:
    """A ball of radius 1 whose faces look outwards; ``open_bottom`` takes the lowest rings off, like a neck."""
    polar = np.linspace(0, np.pi, n_rings + 1)[1:-1]
    around = np.arange(n_sectors) * 2 * np.pi / n_sectors
    p, a = np.meshgrid(polar, around, indexing="ij")
    rings = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=2).reshape(-1, 3)
    vertices = np.concatenate([[[0, 0, 1.0]], rings, [[0, 0, -1.0]]])
    k = np.arange(n_sectors)
    right = (k + 1) % n_sectors
    faces = [np.stack([0 * k, 1 + k, 1 + right], axis=1)]
    for ring in range(len(polar) - 1):
        upper, lower = 1 + ring * n_sectors, 1 + (ring + 1) * n_sectors
        faces.append(np.stack([upper + k, lower + k, lower + right], axis=1))
        faces.append(np.stack([upper + k, lower + right, upper + right], axis=1))
    last = 1 + (len(polar) - 1) * n_sectors
    faces.append(np.stack([0 * k + len(vertices) - 1, last + right, last + k], axis=1))
    triangles = np.concatenate(faces).astype(np.int32)
    if open_bottom:
        triangles = triangles[vertices[triangles][:, :, 2].min(axis=1) > -0.6]
        used = np.unique(triangles)
        triangles = np.searchsorted(used, triangles).astype(np.int32)
        vertices = vertices[used]
    return TriangleMesh(vertices, triangles)


def join(*meshes: TriangleMesh) -> TriangleMesh:
    """Put meshes beside each other in one, vertices and faces in order."""
    offsets = np.cumsum([0] + [m.n_vertices for m in meshes[:-1]])
    triangles = np.concatenate([m.triangles + offset for m, offset in zip(meshes, offsets, strict=True)])
    return TriangleMesh(np.concatenate([m.vertices for m in meshes]), triangles.astype(np.int32))


@pytest.fixture
def ball() -> TriangleMesh:
    return sphere()


@pytest.fixture
def head() -> TriangleMesh:
    """A ball with an open neck."""
    return sphere(open_bottom=True)


@pytest.fixture
def head_with_eyes(head: TriangleMesh) -> TriangleMesh:
    """A head, two eyeballs, and a bag behind the mouth whose faces rightly look inwards."""
    small = sphere(6, 8)
    eyes = [TriangleMesh(0.1 * small.vertices + [0.8, y, 0.3], small.triangles) for y in (-0.3, 0.3)]
    bag = TriangleMesh(0.3 * sphere(6, 8, True).vertices, sphere(6, 8, True).triangles[:, [0, 2, 1]])
    return join(head, *eyes, bag)
