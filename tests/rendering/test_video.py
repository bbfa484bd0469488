from __future__ import annotations

import numpy as np
import pytest

from toolkit.errors import InputError
from toolkit.rendering import write_video

av = pytest.importorskip("av")


def _frames(count: int, height: int = 97, width: int = 131):
    for k in range(count):
        image = np.zeros((height, width, 3), np.uint8)
        image[:, : 20 + 10 * k] = (220, 120, 40)
        yield image


def test_what_is_written_is_read_back(tmp_path):
    path = tmp_path / "clip.mp4"
    assert write_video(path, _frames(7), fps=29.97) == 7
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
        assert float(stream.average_rate) == pytest.approx(29.97, abs=0.01)
        assert stream.codec_context.pix_fmt == "yuv420p"
    assert len(frames) == 7
    assert frames[0].shape == (96, 130, 3)  # even, as 4:2:0 wants
    for k, frame in enumerate(frames):
        assert frame[50, 10].astype(int) == pytest.approx([220, 120, 40], abs=12)
        assert (frame[50, :, 0] > 110).sum() == pytest.approx(20 + 10 * k, abs=2)


def test_the_index_stands_in_front(tmp_path):
    path = tmp_path / "clip.mp4"
    write_video(path, _frames(3), fps=25)
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "clip.mp4"
    path.write_bytes(b"old")

    def broken():
        yield from _frames(2)
        raise RuntimeError("boom")

    with pytest.raises(RuntimeError, match="boom"):
        write_video(path, broken(), fps=25)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["clip.mp4"]


def test_bad_input_is_named(tmp_path):
    path = tmp_path / "clip.mp4"
    with pytest.raises(InputError, match="no pictures"):
        write_video(path, [], fps=25)
    with pytest.raises(InputError, match="0 frames a second"):
        write_video(path, _frames(1), fps=0)
    with pytest.raises(InputError, match="picture 1 is 40 x 30"):
        write_video(path, [*_frames(1), np.zeros((30, 40, 3), np.uint8)], fps=25)
    assert not list(tmp_path.iterdir())
