"""The performer: one head, its 52 shapes, a scripted performance, relief and wrinkles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from data.files import write_json, write_obj
from data.heads import SHAPES, build_head
from data.layout import load_layout
from data.package import Package
from data.performance import expression_weights, head_motion
from data.targets import feature_lines
from toolkit.progress import Progress, silent

__all__ = ["PERFORMER", "build_performer"]

Array = NDArray[np.float64]

PERFORMER = "male_young"


def build_performer(package: Package, level: int, folder: Path, progress: Progress = silent) -> None:
    """Write the performer's files into ``folder``: reference.obj, frames.npy, weights.npy, shapes.npz and others."""
    layout, head = load_layout(package), build_head(package, PERFORMER)
    count = layout.subdivision.counts[level]
    subdivide = layout.subdivision.matrix[:count]
    weights = expression_weights()
    rotations, translations = head_motion(len(weights))
    rest = subdivide @ head.neutral
    write_obj(folder / "reference.obj", rest.astype(np.float32), layout.quads(level))
    shape = (len(weights), count, 3)
    frames = np.lib.format.open_memmap(folder / "frames.npy", mode="w+", dtype=np.float32, shape=shape)
    for t, row in enumerate(weights):
        progress("building the performance", t, len(weights))
        frames[t] = (subdivide @ head.shape(row)) @ rotations[t].T + translations[t]
    frames.flush()
    progress("building the performance", len(weights), len(weights))
    np.save(folder / "weights.npy", weights)
    np.savez(folder / "head_motion.npz", rotations=rotations, translations=translations)
    np.savez(
        folder / "shapes.npz", names=np.array(SHAPES), neutral=head.neutral, offsets=head.offsets.astype(np.float32)
    )
    sp.save_npz(folder / "subdivision.npz", subdivide)
    write_json(folder / "feature_lines.json", {"lines": feature_lines(layout, level)})
    write_json(folder / "landmarks.json", layout.landmarks)
