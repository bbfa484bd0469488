from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.rigid import Similarity
from toolkit.shot import Shot
from toolkit.stages import run_stages

# The target: another shape, size and place.
POSE = Similarity(7.3, Rotation.from_rotvec([0.5, -1.9, 0.7]).as_matrix(), np.array([20.0, -5.0, 40.0]))


def shaken(frames: np.ndarray) -> np.ndarray:
    """With the head's motion in it."""
    turns = np.outer(np.sin(np.linspace(0, 6, len(frames))), [0.1, 0.2, -0.05])
    rotations = Rotation.from_rotvec(turns).as_matrix()
    slid = np.outer(np.linspace(0, 1, len(frames)), [0.3, 0, -0.2])[:, None]
    return np.einsum("tij,tvj->tvi", rotations, frames) + slid


def make_shot(folder: Path, mesh: TriangleMesh, frames: np.ndarray, extra: str = "") -> Shot:
    folder.mkdir(parents=True)
    write_mesh(folder / "source.ply", mesh)
    write_mesh(folder / "target.ply", mesh.with_vertices(POSE.apply(mesh.vertices * [1.15, 0.95, 1.05])))
    np.save(folder / "take.npy", shaken(frames).astype(np.float32))
    text = '[source]\nreference="source.ply"\nframes="take.npy"\nfps=30\n[target]\nreference="target.ply"\n'
    (folder / "shot.toml").write_text(text + "[bases]\ncount=4\n" + extra)
    shot = Shot(folder)
    run_stages(shot)
    return shot


@pytest.fixture(scope="session")
def _made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return {}


@pytest.fixture
def make(bump: TriangleMesh, take: np.ndarray, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, _made: dict):
    """``make(extra)``: a finished shot of its own with more lines in its shot.toml."""

    def shot(extra: str = "") -> Shot:
        if extra not in _made:
            _made[extra] = tmp_path_factory.mktemp("finished") / "shot"
            make_shot(_made[extra], bump, take, extra)
        own = tmp_path / f"shot{len(list(tmp_path.iterdir()))}"
        shutil.copytree(_made[extra], own)
        return Shot(own)

    return shot


@pytest.fixture
def shot(make) -> Shot:
    return make()
