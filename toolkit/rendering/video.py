"""Videos that every player and browser opens: H.264 in an MP4, written aside and renamed into place."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError, MissingDependencyError
from toolkit.meshio.aside import written_aside

__all__ = ["write_video"]

_LOG = logging.getLogger(__name__)
_CODECS = ("libx264", "libopenh264", "mpeg4")
_QUALITY = "20"  # x264's constant rate factor: lower is better and larger


def write_video(path: Path | str, images: Iterable[NDArray[np.uint8]], fps: float) -> int:
    """Write ``images`` (h, w, 3) uint8 one after another and return how many there were.

    H.264 with 4:2:0 colour and the index in front, so that it plays everywhere and while it loads; odd sizes lose
    their last row or column. Where the encoder is missing, MPEG-4 is used and said. An exception on the way leaves
    no file.
    """
    import av

    if not fps > 0 or not np.isfinite(fps):
        raise InputError(f"a video cannot have {fps} frames a second", remedy="give a positive --fps")
    options = {"movflags": "+faststart"}
    with written_aside(path) as temporary, av.open(str(temporary), "w", format="mp4", options=options) as container:
        stream, count = None, 0
        for count, image in enumerate(images, start=1):
            height, width = (n - n % 2 for n in image.shape[:2])
            if stream is None:
                stream = _add_stream(container, (width, height), fps)
            elif (width, height) != (stream.width, stream.height):
                raise InputError(
                    f"picture {count - 1} is {width} x {height}, the first is {stream.width} x {stream.height}",
                    where=path,
                )
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image[:height, :width]), format="rgb24")
            container.mux(stream.encode(frame))
        if stream is None:
            raise InputError("there are no pictures to make a video of", where=path)
        container.mux(stream.encode())
    return count


def _add_stream(container: Any, size: tuple[int, int], fps: float) -> Any:
    codec = _available_codec()
    stream = container.add_stream(codec, rate=Fraction(fps).limit_denominator(1001))
    stream.width, stream.height = size
    stream.pix_fmt = "yuv420p"
    if codec == "libx264":
        stream.options = {"crf": _QUALITY, "preset": "fast"}
    else:
        stream.bit_rate = 8_000_000
    return stream


def _available_codec() -> str:
    import av

    for name in _CODECS:
        if name in av.codecs_available:
            if name == "mpeg4":
                _LOG.warning("this PyAV has no H.264 encoder; the video is MPEG-4, which browsers may not play")
            return name
    raise MissingDependencyError(
        "the installed PyAV has no video encoder",
        remedy="reinstall it from the registry: pip install --force-reinstall av",
    )
