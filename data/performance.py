"""The scripted performance: smooth curves of the 52 shapes and of the head's motion, from ``samples/performance.json``.

An event moves some shapes from nothing to their weights, holds them, and lets go again, with the speed zero at both
ends (quintic easing: twice differentiable). Events of one shape add up, clipped to 0..1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from data.heads import SHAPES
from data.layout import hand_made

__all__ = ["FPS", "event_peaks", "expression_weights", "head_motion"]

Array = NDArray[np.float64]

FPS = 30.0


def expression_weights() -> Array:
    """Weights ``(T, 52)`` in 0..1, in the order of ``SHAPES``."""
    script = hand_made("performance")
    times = np.arange(script["frames"], dtype=np.float64)
    weights = np.zeros((len(times), len(SHAPES)))
    for event in _events(script):
        rise = _ease((times - event["start"]) / (event["peak"][0] - event["start"]))
        fall = _ease((event["end"] - times) / (event["end"] - event["peak"][1]))
        for name, weight in event["shapes"].items():
            for shape in _both_sides(name):
                weights[:, SHAPES.index(shape)] += weight * np.minimum(rise, fall)
    return _lids_free_to_close(np.clip(weights, 0, 1))


def _lids_free_to_close(weights: Array) -> Array:
    """Let squinting and widening go while an eye blinks: shapes add, and the lids would cross or stay apart."""
    for side in ("Left", "Right"):
        blink = weights[:, SHAPES.index(f"eyeBlink{side}")]
        for name in ("eyeSquint", "eyeWide"):
            weights[:, SHAPES.index(name + side)] *= 1 - blink
    return weights


def event_peaks() -> dict[str, int]:
    """Return the frame in the middle of each named event's peak."""
    return {event["name"]: round(sum(event["peak"]) / 2) for event in _events(hand_made("performance"))}


def head_motion(n_frames: int) -> tuple[Array, Array]:
    """Rotations ``(T, 3, 3)`` and translations ``(T, 3)`` in cm: a few degrees of nodding, shaking and tilting.

    Frame 0 is the identity. The head turns about a point in the neck.
    """
    script = hand_made("performance")["head_motion"]
    phase = np.arange(n_frames) / FPS
    begin = _ease(phase / script["begin_s"])[:, None]
    angles = begin * np.radians(_waves(script["rotate_degrees"], phase))
    shifts = begin * _waves(script["translate_cm"], phase)
    rotations = np.stack([_turn(*angle) for angle in angles])
    pivot = np.array(script["pivot_cm"], dtype=np.float64)
    return rotations, shifts + pivot - rotations @ pivot


def _events(script: dict[str, Any]) -> list[dict[str, Any]]:
    blinks = [
        {
            "name": f"blink at {start}",
            "start": start,
            "peak": [start + 3, start + 4],
            "end": start + 10,
            "shapes": {"eyeBlink": 1.0},
        }
        for start in script["blinks"]
    ]
    sounds = []
    for k, (start, shapes) in enumerate(script["talking"]):
        length = script["sound_frames"]
        peak = start + length / 2
        sounds.append(
            {"name": f"sound {k}", "start": start, "peak": [peak, peak], "end": start + length, "shapes": shapes}
        )
    return [*script["events"], *sounds, *blinks]


def _both_sides(name: str) -> list[str]:
    return [name] if name in SHAPES else [f"{name}Left", f"{name}Right"]


def _ease(t: Array) -> Array:
    t = np.clip(t, 0, 1)
    return t**3 * (10 - 15 * t + 6 * t**2)


def _waves(parts: list[list[list[float]]], seconds: Array) -> Array:
    """Sum of sines (amplitude, period in s, phase in turns) for each of three axes, ``(T, 3)``."""
    axes = [
        sum((a * np.sin(2 * np.pi * (seconds / period + phase)) for a, period, phase in axis), np.zeros(len(seconds)))
        for axis in parts
    ]
    return np.stack(axes, axis=1)


def _turn(x: float, y: float, z: float) -> Array:
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)
