from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from toolkit.meshio.aside import written_aside
from toolkit.meshio.npy import write_array, write_blocks
from toolkit.meshio.sequence import FrameSequence, cache_as_npy

FULL = Path("/dev/full")


@pytest.mark.parametrize(
    "array",
    [np.arange(6.0).reshape(2, 3), np.zeros((0, 3), np.int32), np.array(2.5), np.eye(4)[:, ::2], np.ones(3, bool)],
)
def test_the_bytes_are_numpys(tmp_path: Path, array: np.ndarray) -> None:
    write_array(tmp_path / "a.npy", array)
    np.save(tmp_path / "b.npy", np.asarray(array, order="C"))
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "b.npy").read_bytes()


def test_blocks_follow_each_other(tmp_path: Path) -> None:
    whole = np.arange(60.0).reshape(5, 4, 3)
    write_blocks(tmp_path / "a.npy", whole.shape, np.float32, [whole[:2], whole[2:]])
    loaded = np.load(tmp_path / "a.npy")
    assert loaded.dtype == np.float32
    np.testing.assert_array_equal(loaded, whole)


@pytest.mark.skipif(not FULL.exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_said_with_its_reason() -> None:
    with pytest.raises(OSError, match="No space left") as caught:
        write_array(FULL, np.zeros(100_000))
    assert caught.value.errno == errno.ENOSPC


def test_a_take_is_cached_frame_by_frame(tmp_path: Path) -> None:
    frames = np.random.default_rng(3).normal(size=(7, 5, 3)).astype(np.float32)
    said: list[int] = []
    sequence = FrameSequence(7, 5, 24.0, "take", lambda a, b: frames[a:b])
    cached = cache_as_npy(sequence, tmp_path / "frames.npy", lambda _what, done, _total: said.append(done))
    np.testing.assert_array_equal(cached.read(0, 7), frames)
    assert cached.fps == 24.0
    assert said[-1] == 7


def test_no_room_is_said_before_any_work(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No space left") as caught, written_aside(tmp_path / "a.abc", room=2**62):
        pytest.fail("nothing should be written")
    assert caught.value.errno == errno.ENOSPC
    assert caught.value.filename == str(tmp_path / "a.abc")
    assert not list(tmp_path.iterdir())
