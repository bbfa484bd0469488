"""Videos that every player and browser opens: H.264 in an MP4, written aside and renamed into place."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError, MissingDependencyError

__all__ = ["write_video"]

_LOG = logging.getLogger(__name__)
_CODECS = ("libx264", "libopenh264", "mpeg4")


def write_video(path: Path | str, images: Iterable[NDArray[np.uint8]], fps: float, *, quality: int = 20) -> int:
    """Write ``images`` (h, w, 3) uint8 one after another and return how many there were.

    H.264 with 4:2:0 colour and the index in front, so that it plays everywhere and while it loads; odd sizes lose
    their last row or column. Where the encoder is missing, MPEG-4 is used and said. ``quality`` is x264's constant
    rate factor: lower is better and larger. An exception on the way leaves no file.
    """
    import av

    if not fps > 0 or not np.isfinite(fps):
        raise InputError(f"a video cannot have {fps} frames a second", remedy="give a positive --fps")
    codec = _available_codec()
    target = Path(path)
    aside = target.with_name(f".{target.stem}.partial{target.suffix or '.mp4'}")
    count = 0
    try:
        with av.open(str(aside), "w", format="mp4", options={"movflags": "+faststart"}) as container:
            stream = None
            for image in images:
                height, width = (n - n % 2 for n in image.shape[:2])
                if stream is None:
                    stream = container.add_stream(codec, rate=Fraction(fps).limit_denominator(1001))
                    stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
                    stream.options = {"crf": str(quality), "preset": "fast"} if codec == "libx264" else {}
                    if codec != "libx264":
                        stream.bit_rate = 8_000_000
                elif (width, height) != (stream.width, stream.height):
                    raise InputError(
                        f"picture {count} is {width} x {height}, the first is {stream.width} x {stream.height}",
                        where=target,
                    )
                frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image[:height, :width]), format="rgb24")
                container.mux(stream.encode(frame))
                count += 1
            if stream is None:
                raise InputError("there are no pictures to make a video of", where=target)
            container.mux(stream.encode())
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)
    return count


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
