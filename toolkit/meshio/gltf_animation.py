"""A glTF animation evaluated at any time: linear, step and cubic spline channels."""

from __future__ import annotations

import logging
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.meshio.gltf_file import GltfFile
from toolkit.meshio.gltf_scene import Pose

__all__ = ["Clip", "moving_clip"]

logger = logging.getLogger(__name__)

Array = NDArray[np.float64]
_DEFAULT_FPS = 30.0
_SNAP = 1e-4  # share of a key interval: times are float32 in the file, and a key should be met exactly


@dataclass(frozen=True)
class _Channel:
    """Keys of one property of one node: ``times`` (N,), ``values`` (N, C), or (N, 3, C) of a cubic spline."""

    node: int
    path: str
    times: Array
    values: Array
    interpolation: str


@dataclass(frozen=True)
class Clip:
    """One animation: the channels that move vertices."""

    channels: list[_Channel]

    @property
    def start(self) -> float:
        """Time of the first key, in seconds."""
        return float(min(channel.times[0] for channel in self.channels))

    @property
    def duration(self) -> float:
        """Time from the first key to the last, in seconds."""
        return float(max(channel.times[-1] for channel in self.channels)) - self.start

    def frame_rate(self) -> float:
        """Return the rate that all keys lie on, or 30 where they lie on none: the format itself has no frame rate."""
        times = np.unique(np.concatenate([channel.times for channel in self.channels]))
        steps = np.diff(times)
        steps = steps[steps > 1e-3 * max(self.duration / max(len(times), 1), 1e-9)]
        if len(steps):
            n_steps = max(round(self.duration / float(steps.min())), 1)
            on_grid = (times - self.start) * (n_steps / self.duration)
            if np.abs(on_grid - np.round(on_grid)).max() < 0.02 and len(times) > 2:
                return float(round(n_steps / self.duration, 3))
        logger.info("the animation's keys lie on no frame rate, it is sampled at %g frames a second", _DEFAULT_FPS)
        return _DEFAULT_FPS

    def pose(self, time: float) -> Pose:
        """Return the animated values at ``time``, in seconds; before the first and after the last key they hold."""
        return {(channel.node, channel.path): _value(channel, time) for channel in self.channels}


def moving_clip(file: GltfFile, influences: set[int]) -> Clip:
    """Return the first animation that moves one of the nodes ``influences``.

    Raises
    ------
    InputError : no animation does
    """
    animations = file.items("animations")
    for index, animation in enumerate(animations):
        channels = [
            _channel(file, channel, animation["samplers"])
            for channel in animation["channels"]
            if channel["target"].get("node") in influences and channel["target"]["path"] != "pointer"
        ]
        if channels:
            if len(animations) > 1:
                name = animation.get("name", index)
                logger.info("%s: has %d animations, animation %s is read", file.path, len(animations), name)
            return Clip(channels)
    what = f"none of its {len(animations)} animations moves a mesh"
    raise InputError(what, where=file.path, remedy="export it with its animation")


def _channel(file: GltfFile, channel: dict, samplers: list[dict]) -> _Channel:
    sampler, target = samplers[channel["sampler"]], channel["target"]
    times = file.accessor(sampler["input"]).astype(np.float64)
    values = file.accessor(sampler["output"]).astype(np.float64)
    interpolation = sampler.get("interpolation", "LINEAR")
    rows = (len(times), 3, -1) if interpolation == "CUBICSPLINE" else (len(times), -1)
    if len(times) == 0 or values.size % max(len(times), 1):
        what = f"an animation has {len(times)} times for {values.size} values"
        raise InputError(what, where=file.path, remedy="it is damaged, export it again")
    return _Channel(target["node"], target["path"], times, values.reshape(rows), interpolation)


def _value(channel: _Channel, time: float) -> Array:
    times, values = channel.times, channel.values
    cubic = channel.interpolation == "CUBICSPLINE"
    keys = values[:, 1] if cubic else values
    before = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 1))
    if before == len(times) - 1 or time <= times[0]:
        return keys[before]
    step = times[before + 1] - times[before]
    u = (time - times[before]) / step
    if u < _SNAP or u > 1 - _SNAP:
        return keys[before + round(u)]
    if channel.interpolation == "STEP":
        return keys[before]
    if cubic:
        return _hermite(values[before], values[before + 1], u, step)
    if channel.path == "rotation":
        return _slerp(keys[before], keys[before + 1], u)
    return (1 - u) * keys[before] + u * keys[before + 1]


def _hermite(left: Array, right: Array, u: float, step: float) -> Array:
    """Cubic through (in-tangent, value, out-tangent) keys; a quaternion is normalised by its user."""
    start, out_tangent, end, in_tangent = left[1], step * left[2], right[1], step * right[0]
    u2, u3 = u * u, u * u * u
    eased = (2 * u3 - 3 * u2 + 1) * start + (3 * u2 - 2 * u3) * end
    return eased + (u3 - 2 * u2 + u) * out_tangent + (u3 - u2) * in_tangent


def _slerp(a: Array, b: Array, u: float) -> Array:
    cosine = float(np.dot(a, b))
    if cosine < 0:
        b, cosine = -b, -cosine
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-6:
        return (1 - u) * a + u * b
    return (np.sin((1 - u) * angle) * a + np.sin(u * angle) * b) / np.sin(angle)
