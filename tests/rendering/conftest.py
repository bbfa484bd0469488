from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture(scope="session")
def sphere() -> tuple[np.ndarray, np.ndarray]:
    """Unit sphere (2562, 3) and its triangles, counter-clockwise seen from outside."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=4)
    return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32)
