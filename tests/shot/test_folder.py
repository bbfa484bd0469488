from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.shot import Shot
from toolkit.shot.hashing import HashCache, key_of


@pytest.fixture
def shot(tmp_path: Path) -> Shot:
    (tmp_path / "shot.toml").write_text('[source]\nreference="s"\nframes="f"\n[target]\nreference="t"\n')
    return Shot(tmp_path)


def _write(shot: Shot, key: str, value: float) -> None:
    with shot.write_stage("bases", key, {}) as folder:
        folder.save("weights", np.full(4, value))
        folder.create("big", (2, 3))[:] = value
        folder.numbers["value"] = value


def test_a_stage_is_current_with_its_key_and_arrays(shot: Shot) -> None:
    assert not shot.is_current("bases", "k1")
    _write(shot, "k1", 1.0)
    assert shot.is_current("bases", "k1")
    assert not shot.is_current("bases", "k2")
    assert shot.array("bases", "big").tolist() == [[1, 1, 1]] * 2
    (shot.stage_folder("bases") / "big.npy").unlink()
    assert not shot.is_current("bases", "k1")


def test_a_failure_leaves_the_old_stage(shot: Shot) -> None:
    _write(shot, "k1", 1.0)

    def fail_halfway() -> None:
        with shot.write_stage("bases", "k2", {}) as folder:
            folder.save("weights", np.zeros(4))
            raise RuntimeError("halfway")

    with pytest.raises(RuntimeError, match="halfway"):
        fail_halfway()
    assert shot.is_current("bases", "k1")
    assert shot.array("bases", "weights").tolist() == [1, 1, 1, 1]
    assert [path.name for path in (shot.path / "stages").iterdir()].count("bases") == 1


@pytest.mark.parametrize("moment", range(4))
def test_a_kill_leaves_the_old_or_the_new(shot: Shot, moment: int) -> None:
    _write(shot, "old", 1.0)
    script = f"""
        import os, sys, threading, time
        import numpy as np
        from toolkit.shot import Shot
        shot = Shot({str(shot.path)!r})
        print("ready", flush=True)
        for n in range(100000):
            with shot.write_stage("bases", "new", {{}}) as folder:
                folder.save("weights", np.full(200000, 2.0))
                folder.create("big", (2, 3))[:] = 2
    """
    process = subprocess.Popen([sys.executable, "-c", textwrap.dedent(script)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "ready"
    try:
        process.wait(timeout=0.05 + 0.033 * moment)
    except subprocess.TimeoutExpired:
        os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    again = Shot(shot.path)
    again.remove_leftovers()
    manifest = again.manifest("bases")
    # Between the two renames of a folder there may be none for a moment; then the stage is simply run again.
    if manifest is not None:
        value = 1.0 if manifest["key"] == "old" else 2.0
        assert again.is_current("bases", manifest["key"])
        assert (again.array("bases", "weights") == value).all()
        assert (again.array("bases", "big") == value).all()
    assert not list((again.path / "stages").glob(".*"))


def test_a_missing_stage_says_what_to_run(shot: Shot) -> None:
    with pytest.raises(InputError, match="run_all"):
        shot.array("bases", "weights")
    with pytest.raises(InputError, match="new_shot"):
        Shot(shot.path / "nothing")


def test_hashes_follow_the_content(tmp_path: Path) -> None:
    file = tmp_path / "a.bin"
    file.write_bytes(b"one")
    cache = HashCache(tmp_path / "hashes.json")
    first = cache.of(file)
    cache.save()
    assert HashCache(tmp_path / "hashes.json").of(file) == first
    file.write_bytes(b"two!")
    second = HashCache(tmp_path / "hashes.json").of(file)
    assert second != first
    other = tmp_path / "b.bin"
    other.write_bytes(b"two!")
    assert cache.of(other) == second
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "x").write_bytes(b"1")
    whole = cache.of(tmp_path / "folder")
    (tmp_path / "folder" / "y").write_bytes(b"1")
    assert cache.of(tmp_path / "folder") != whole
    with pytest.raises(InputError, match="no such file"):
        cache.of(tmp_path / "missing")


def test_keys_do_not_depend_on_order() -> None:
    assert key_of({"a": 1, "b": {"c": 2.5, "d": None}}) == key_of({"b": {"d": None, "c": 2.5}, "a": 1})
    assert key_of({"a": 1}) != key_of({"a": 2})


@pytest.mark.parametrize("name", ["weights.npy", "picks.json"])
def test_a_stage_cut_short_is_not_current(shot: Shot, name: str) -> None:
    with shot.write_stage("bases", "k1", {}) as folder:
        folder.save("weights", np.ones(4))
        (folder.path / "picks.json").write_text("[1, 2]", encoding="utf-8")
    assert shot.is_current("bases", "k1")
    os.truncate(shot.stage_folder("bases") / name, 3)
    assert not shot.is_current("bases", "k1")


@pytest.mark.parametrize("left", [3, 100, 140])
def test_a_damaged_array_says_what_to_do(shot: Shot, left: int) -> None:
    _write(shot, "k1", 1.0)
    os.truncate(shot.stage_folder("bases") / "weights.npy", left)
    with pytest.raises(InputError, match=r"weights\.npy: is damaged or cut short .*run_all\.py"):
        shot.array("bases", "weights")
