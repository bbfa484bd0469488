import struct
from pathlib import Path

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.meshio import cache_as_npy, open_sequence

FRAMES = np.random.default_rng(0).normal(size=(7, 5, 3)).astype(np.float32)


def pc2(frames, n_frames=None, magic=b"POINTCACHE2\0"):
    head = magic + struct.pack("<iiffi", 1, frames.shape[1], 0, 1, n_frames or len(frames))
    return head + frames.astype("<f4").tobytes()


def mdd(frames, fps=25, n_frames=None):
    n = n_frames or len(frames)
    head = struct.pack(">ii", n, frames.shape[1]) + struct.pack(f">{n}f", *(np.arange(n) / fps))
    return head + frames.astype(">f4").tobytes()


def save(path):
    if path.suffix == ".npy":
        np.save(path, FRAMES)
    elif path.suffix == ".npz":
        np.savez(path, other=np.zeros(3), frames=FRAMES, more=FRAMES[:1])
    else:
        path.write_bytes({".pc2": pc2, ".mdd": mdd}[path.suffix](FRAMES))
    return path


@pytest.mark.parametrize("suffix", [".npy", ".npz", ".pc2", ".mdd"])
def test_frames_come_back_bit_for_bit(tmp_path, suffix):
    sequence = open_sequence(save(tmp_path / f"take{suffix}"))
    assert (len(sequence), sequence.n_vertices, sequence.triangles) == (7, 5, None)
    block = sequence.read(2, 6)
    assert block.dtype == np.float32
    assert block.dtype.isnative
    np.testing.assert_array_equal(block, FRAMES[2:6])
    assert sequence.read(7, 7).shape == (0, 5, 3)
    block[:] = 0  # the caller's own copy
    np.testing.assert_array_equal(sequence.read(0, 7), FRAMES)
    with pytest.raises(IndexError, match="5:8"):
        sequence.read(5, 8)


def test_frame_rates(tmp_path):
    assert open_sequence(save(tmp_path / "a.mdd")).fps == 25
    assert open_sequence(save(tmp_path / "a.mdd"), fps=60).fps == 60
    assert open_sequence(save(tmp_path / "a.npy")).fps is None
    assert open_sequence(save(tmp_path / "a.pc2"), fps=30).fps == 30
    with pytest.raises(InputError, match="-1 frames a second"):
        open_sequence(tmp_path / "a.npy", fps=-1)


def test_npz_takes_the_only_sequence_and_refuses_to_guess(tmp_path):
    np.savez(tmp_path / "one.npz", take=FRAMES, triangles=np.zeros((4, 3)))
    np.testing.assert_array_equal(open_sequence(tmp_path / "one.npz").read(0, 7), FRAMES)
    np.savez(tmp_path / "two.npz", a=FRAMES, b=FRAMES)
    with pytest.raises(InputError, match=r"2 arrays of shape .* among a, b; name the one to use 'frames'"):
        open_sequence(tmp_path / "two.npz")


def test_large_files_are_mapped_not_read(tmp_path, monkeypatch):
    for suffix in (".npy", ".pc2", ".mdd"):
        path = save(tmp_path / f"take{suffix}")
        sequence = open_sequence(path)
        backing = sequence.read_block(0, 2)
        while not isinstance(backing, np.memmap):
            backing = backing.base
        assert backing.filename == path


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.pc2", pc2(FRAMES, n_frames=9), "says 9 frames of 5 points, but the file holds 7; it is cut short"),
        ("a.pc2", pc2(FRAMES)[:-1], "says 7 frames of 5 points, but the file holds 6"),
        ("a.pc2", pc2(FRAMES, magic=b"POINTCACHE1\0"), "not a PC2"),
        ("a.pc2", b"POINT", "has 5 bytes"),
        ("a.pc2", pc2(FRAMES[:, :0]), "7 frames of 0 points"),
        ("a.mdd", mdd(FRAMES)[:-4], "says 7 frames of 5 points, but the file holds 6"),
        ("a.mdd", struct.pack(">ii", 2**31 - 1, 2**31 - 1), "but the file holds 0"),
        ("a.mdd", struct.pack(">ii", 0, 4), "0 frames of 4 points"),
        ("a.npy", b"not numpy", "cannot be read as a NumPy file"),
        ("a.npz", b"not numpy", "cannot be read as a NumPy file"),
    ],
)
def test_damaged_files_are_refused(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=said):
        open_sequence(tmp_path / name)


@pytest.mark.parametrize(
    ("array", "said"),
    [
        (np.zeros((4, 3)), r"shape \(4, 3\); save one array of shape \(frames, vertices, 3\)"),
        (np.zeros((4, 5, 2)), r"shape \(4, 5, 2\)"),
        (np.zeros((0, 5, 3)), "0 frames of 5 vertices"),
        (np.zeros((2, 5, 3), dtype=complex), "type complex128"),
        (np.full((2, 5, 3), None), "cannot be read"),
    ],
)
def test_wrong_arrays_are_refused(tmp_path, array, said):
    np.save(tmp_path / "a.npy", array)
    with pytest.raises(InputError, match=said):
        open_sequence(tmp_path / "a.npy")


def test_a_cut_npy_is_refused(tmp_path):
    path = save(tmp_path / "a.npy")
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(InputError, match="cannot be read as a NumPy file"):
        open_sequence(path)


def test_cache_as_npy_copies_by_blocks_and_reports(tmp_path, monkeypatch):
    monkeypatch.setattr("toolkit.meshio.sequence._BLOCK_BYTES", 3 * 5 * 12)
    sequence = open_sequence(save(tmp_path / "a.mdd"))
    reports = []
    cached = cache_as_npy(sequence, tmp_path / "cache" / "a.npy", lambda *report: reports.append(report))
    np.testing.assert_array_equal(cached.read(0, 7), FRAMES)
    assert cached.fps == 25
    assert reports == [("reading frames", n, 7) for n in (3, 6, 7)]
    np.testing.assert_array_equal(np.load(tmp_path / "cache" / "a.npy"), FRAMES)


def test_a_cancelled_cache_leaves_nothing(tmp_path):
    def cancel(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        cache_as_npy(open_sequence(save(tmp_path / "a.npy")), tmp_path / "cache" / "a.npy", cancel)
    assert list((tmp_path / "cache").iterdir()) == []


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="asks Linux what is mapped")
@pytest.mark.parametrize("suffix", [".npy", ".pc2", ".mdd"])
def test_what_was_read_does_not_stay_mapped(tmp_path, suffix):
    path = save(tmp_path / f"take{suffix}")
    sequence = open_sequence(path)
    block = sequence.view(2, 6)
    np.testing.assert_array_equal(block, FRAMES[2:6])
    assert (str(path) in Path("/proc/self/maps").read_text()) == (suffix != ".mdd")  # its byte order is turned
    del block
    assert str(path) not in Path("/proc/self/maps").read_text()
