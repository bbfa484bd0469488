"""What the benchmarks of speed and scale stand on: meshes of any size, fits, the peers' own code, limits."""

from __future__ import annotations

import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks._peers.comparison import Comparison, run_limited
from benchmarks._peers.deformation_transfer import transfer_frames
from benchmarks._scale.takes import split_longest_edges
from benchmarks.growth import exponent
from toolkit.mesh import TriangleMesh, connected_components, triangle_areas

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", ["table1", "edits", "peers", "growth"])
def test_help(name: str) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / f"{name}.py"), "--help"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "--json" in done.stdout


def test_rows_of_table_1_are_checked() -> None:
    command = [sys.executable, str(ROOT / "benchmarks" / "table1.py"), "--rows", "1,10"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "not a list of rows" in done.stderr


def test_splitting_edges_gives_exactly_so_many_vertices(bump: TriangleMesh) -> None:
    for wanted in (bump.n_vertices, bump.n_vertices + 1, 3000):
        triangles, matrix = split_longest_edges(bump.vertices, bump.triangles, wanted)
        points = matrix @ bump.vertices
        assert matrix.shape == (wanted, bump.n_vertices)
        assert np.allclose(matrix.sum(axis=1), 1)
        assert np.array_equal(points[: bump.n_vertices], bump.vertices)
        before, after = triangle_areas(bump.vertices, bump.triangles), triangle_areas(points, triangles)
        assert after.sum() == pytest.approx(before.sum())
        # Each new vertex closes one loop: the surface stays whole, and no edge has three faces.
        sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        edges, uses = np.unique(sides, axis=0, return_counts=True)
        assert uses.max() == 2
        assert wanted - len(edges) + len(triangles) == 1
        assert connected_components(triangles, wanted)[0] == 1


def test_the_exponent_is_that_of_a_power() -> None:
    sizes = [10, 20, 40, 80]
    assert exponent(sizes, [3 * size**1.3 for size in sizes]) == pytest.approx(1.3)


def test_the_peers_deformation_transfer_is_right(bump: TriangleMesh) -> None:
    """A turned and grown source is a target turned and grown; a source at rest leaves the target."""
    turn = 1.3 * Rotation.from_rotvec([0.4, -0.2, 0.7]).as_matrix()
    target = bump.vertices * [1.1, 0.9, 1.2] + 0.05 * np.sin(5 * bump.vertices[:, [1, 2, 0]])
    frames = np.stack([bump.vertices, bump.vertices @ turn.T])
    rest, turned = transfer_frames(bump.vertices, frames, target, bump.triangles, np.array([0]))
    assert np.abs(rest - target).max() < 1e-9
    assert np.abs(_centred(turned) - _centred(target @ turn.T)).max() < 1e-9


def _centred(points: np.ndarray) -> np.ndarray:
    return points - points.mean(axis=0)


def test_ahead_means_faster_and_as_good() -> None:
    even = Comparison("x", "", ours_s=1.0, peer_s=5.0, ours=0.1, peer=0.1, unit="")
    row = partial(replace, even)
    assert row().ahead
    assert row().ratio == 5
    assert not row(peer_s=0.9).ahead
    assert not row(ours=0.11).ahead
    stopped = row(peer=float("nan"), stopped=True)
    assert stopped.ahead
    assert ">5.0" in stopped.line()
    assert "NOT AHEAD" in row(ours=0.11).line()


def test_a_peer_that_takes_too_long_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    result, seconds = run_limited(abs, (-3,), 60)
    assert result == 3
    assert seconds < 60
    began = time.monotonic()
    result, seconds = run_limited(time.sleep, (100,), -59.0)
    assert result is None
    assert time.monotonic() - began < 30
