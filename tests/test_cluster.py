"""Frames on a Dask cluster of two local processes: the same bytes as here, also when one of them dies."""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from toolkit import cluster as cluster_module
from toolkit.blocks import map_blocks
from toolkit.cluster import Cluster
from toolkit.editing import EditSession
from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.pose_edit import EditParameters, PointConstraint
from toolkit.shot import Shot
from toolkit.stages import run_stages
from toolkit.stages.blocks import StageBlocks

distributed = pytest.importorskip("distributed")
cloudpickle = pytest.importorskip("cloudpickle")

ARRAYS = (
    ("decompose", "smooth_deltas"),
    ("decompose", "details"),
    ("decompose", "detail_energy"),
    ("result", "frames"),
)


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    # The workers cannot import this file: what it hands them goes whole.
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as local:
        yield local.scheduler_address
    cloudpickle.unregister_pickle_by_value(sys.modules[__name__])


def make_shot(folder: Path, mesh: TriangleMesh, frames: np.ndarray, extra: str = "") -> Shot:
    folder.mkdir(parents=True)
    write_mesh(folder / "source.ply", mesh)
    write_mesh(folder / "target.ply", mesh.with_vertices(mesh.vertices * [1.2, 0.9, 1.1]))
    np.save(folder / "take.npy", np.tile(frames, (7, 1, 1))[:265].astype(np.float32))
    text = '[source]\nreference="source.ply"\nframes="take.npy"\nfps=30\n[target]\nreference="target.ply"\n'
    (folder / "shot.toml").write_text(text + extra)
    return Shot(folder)


@dataclass
class Deadly:
    """Work whose first taker dies at one block: the marker says that it was tried."""

    work: StageBlocks
    marker: Path
    frame: int

    def __call__(self, start: int, stop: int) -> None:
        if start == self.frame and not self.marker.exists():
            self.marker.write_text(str(os.getpid()))
            os.kill(os.getpid(), signal.SIGKILL)
        self.work(start, stop)


@pytest.mark.parametrize("extra", ["", '[details]\nmethod = "coating"\n'])
def test_the_cluster_gives_the_same_bytes(
    bump: TriangleMesh, take: np.ndarray, tmp_path: Path, scheduler: str, extra: str
) -> None:
    here, there = (make_shot(tmp_path / name, bump, take, extra) for name in ("here", "there"))
    run_stages(here)
    with Cluster(scheduler) as cluster:
        cluster.check_sees(there.path)
        run_stages(there, map_blocks=cluster.map_blocks)
    for stage, name in ARRAYS:
        assert here.array(stage, name).tobytes() == there.array(stage, name).tobytes(), name


def test_a_lost_workers_chunk_is_done_again(
    bump: TriangleMesh, take: np.ndarray, tmp_path: Path, scheduler: str
) -> None:
    """The worker that comes first to frame 144, in the middle of the third chunk, kills itself, once in each stage."""
    here, there = (make_shot(tmp_path / name, bump, take) for name in ("here", "there"))
    run_stages(here)
    with Cluster(scheduler) as cluster:

        def with_a_death(work, n_frames, size, *, what, progress):  # type: ignore[no-untyped-def]
            deadly = Deadly(work, tmp_path / what, 144)
            cluster.map_blocks(deadly, n_frames, size, what=what, progress=progress)

        run_stages(there, map_blocks=with_a_death)
    died = {(tmp_path / what).read_text() for what in ("decomposing frames", "building frames")}
    assert len(died) == 2
    assert str(os.getpid()) not in died
    for stage, name in ARRAYS:
        assert here.array(stage, name).tobytes() == there.array(stage, name).tobytes(), name


def test_edits_go_along(bump: TriangleMesh, take: np.ndarray, tmp_path: Path, scheduler: str) -> None:
    here, there = (make_shot(tmp_path / name, bump, take) for name in ("here", "there"))
    run_stages(here)
    unedited = here.frames_path.read_bytes()
    session = EditSession.open(here)
    session.draft_pose([PointConstraint(100, 360, offset=(0.0, 0.05, 0.0))], EditParameters(window=(80, 130)))
    session.commit()
    shutil.copy(here.edits_path, there.edits_path)
    run_stages(here)
    with Cluster(scheduler) as cluster:
        run_stages(there, map_blocks=cluster.map_blocks)
    assert here.frames_path.read_bytes() == there.frames_path.read_bytes()
    assert here.frames_path.read_bytes() != unedited


def test_an_error_on_a_worker_is_raised_here_as_it_was(tmp_path: Path, scheduler: str) -> None:
    def broken(start: int, stop: int) -> None:
        raise InputError(f"frame {start} is gone", where=tmp_path, remedy="look for it")

    with Cluster(scheduler) as cluster, pytest.raises(InputError) as caught:
        cluster.map_blocks(broken, 3, 16, what="trying")
    assert str(caught.value) == f"{tmp_path}: frame 0 is gone; look for it."


def test_a_folder_that_workers_do_not_see_is_bad_input(tmp_path: Path, scheduler: str) -> None:
    with distributed.Client(scheduler) as client:
        client.wait_for_workers(2, timeout=60)  # one that died in a test before may still be on its way back
    with Cluster(scheduler) as cluster, pytest.raises(InputError, match="2 of 2 Dask workers do not see"):
        cluster.check_sees(tmp_path / "elsewhere")


def test_no_scheduler_is_bad_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "_PATIENCE_S", 1)
    with pytest.raises(InputError, match="no Dask scheduler that answers"):
        Cluster("tcp://127.0.0.1:9")


def test_blocks_pickle_as_paths(tmp_path: Path) -> None:
    """What travels is small, and what was opened stays."""
    filled = np.lib.format.open_memmap(tmp_path / "x.npy", mode="w+", dtype=np.float32, shape=(50, 1000))
    big = np.arange(50_000, dtype=np.float32).reshape(50, 1000)

    def fill(start: int, stop: int, out: np.ndarray) -> None:
        out[:] = big[start:stop]

    blocks = StageBlocks(("x",), opened_again, tmp_path, tmp_path, fill)
    map_blocks(blocks, 30, 16, what="filling")
    packed = cloudpickle.dumps(blocks)
    assert len(packed) < 5000
    again = pickle.loads(packed)
    again(30, 46)
    again(46, 50)
    assert np.array_equal(filled[:30], big[:30])
    assert np.array_equal(filled[30:, 0], np.arange(30, 50))


def opened_again(shot: Path, folder: Path):  # type: ignore[no-untyped-def]
    def fill(start: int, stop: int, out: np.ndarray) -> None:
        out[:] = np.arange(start, stop)[:, None]

    return fill
