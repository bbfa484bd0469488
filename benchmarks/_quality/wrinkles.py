"""Section "wrinkles": the source's wrinkles on another person, beside that person's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks._quality.ict import IctPair
from benchmarks._quality.rows import Row, Section, at_least, at_most, measured
from benchmarks._quality.shots import Take, make_shot, run_with
from toolkit.coating_details import CoatingDetails
from toolkit.decomposition import Decomposer
from toolkit.details import DetailParameters, Reconstruction, detail_gain
from toolkit.kernels import block_to_frames
from toolkit.meshio import write_mesh
from toolkit.progress import Progress
from toolkit.quality import detail_error
from toolkit.rigid import umeyama
from toolkit.stabilisation import HeadMotion

__all__ = ["section"]

Array = NDArray[np.float64]

_MM = 10.0
_DEEP_CM = 0.01
_METHODS = {
    "displacement, local scale": DetailParameters(),
    "displacement, global scale": DetailParameters(scale="global"),
    "the paper's coating, screened 0.1": DetailParameters(method="coating", screening=0.1),
    "the paper's coating, screened 0.3": DetailParameters(method="coating", screening=0.3),
    "the target's own rest detail alone": DetailParameters(gain=0.0),
}
_DEFAULT = "displacement, local scale"


def section(data: Path | None, folder: Path, frames: list[int] | None, progress: Progress) -> Section:
    """Details alone on the true large-scale shape, then the whole pipeline."""
    if data is None:
        return Section("wrinkles", "Skipped: this section needs the ICT pair; give its folder with --ict DIR.", ())
    pair = IctPair(data)
    chosen = frames or np.linspace(0, len(pair.weights) - 1, 7).round().astype(int)[1:-1].tolist()
    weights = pair.weights[chosen]
    bench = _Details(pair, weights, progress)
    rows = [measured("true detail, RMS", _MM * bench.true_rms, "mm"), measured("true detail, largest", *bench.largest)]
    for name, parameters in _METHODS.items():
        rows += _judged(name, bench.found(parameters), bench.true, name == _DEFAULT)
    deep = bench.found(DetailParameters(), own_depth=True)
    rows += _judged("displacement, source wrinkles as deep as the target's", deep, bench.true, False)
    rows += _judged("whole pipeline", _pipeline(pair, weights, bench, folder, progress), bench.true, False)
    about = (
        f"ICT pair, {pair.source().n_vertices} vertices, frames {', '.join(map(str, chosen))} of the take, true "
        "correspondence. Details G_t (e_0' + g s d_t) on the known answer's smoothed shape against the answer less its "
        "smoothed shape; correlation where the true detail exceeds 0.1 mm. The whole pipeline: result less its "
        "smoothed shape."
    )
    return Section("wrinkles", about, tuple(rows))


def _judged(name: str, found: Array, true: Array, judge: bool) -> list[Row]:
    error = detail_error(found, true, _DEEP_CM)
    labels = (f"{name}: RMS error", f"{name}: correlation")
    if judge:
        first, second = at_most(labels[0], _MM * error.rms, 0.02, "mm"), at_least(labels[1], error.correlation, 0.9)
    else:
        first, second = measured(labels[0], _MM * error.rms, "mm"), measured(labels[1], error.correlation)
    return [first, second, measured(f"{name}: largest error", _MM * error.largest, "mm")]


class _Details:
    """The engine's own detail transfer on large-scale shapes that are known: bases are the frames themselves."""

    def __init__(self, pair: IctPair, weights: Array, progress: Progress) -> None:
        self._pair, self._weights = pair, weights
        source, target = pair.source(), pair.target()
        self.source = Decomposer(source)
        self.pose = umeyama(source.vertices, target.vertices)
        back = self.pose.inverse()
        moved = target.with_vertices(back.apply(target.vertices))
        self.target = Decomposer(moved, None, self.source.rest.neighbour)
        answers = []
        for k, row in enumerate(weights):
            answers.append(back.apply(pair.answer(row)))
            progress("making the known answers", k + 1, len(weights))
        self._large = np.stack([self.target.filter.smooth(answer) for answer in answers])
        self.true = self.pose.scale * (np.stack(answers) - self._large) @ self.pose.rotation.T
        lengths = np.linalg.norm(self.true, axis=2)
        self.true_rms = float(np.sqrt(np.mean(lengths**2)))
        self.largest = (_MM * float(lengths.max()), "mm")

    def found(self, parameters: DetailParameters, *, own_depth: bool = False) -> Array:
        """Details ``(T, V, 3)`` in the target's unit."""
        make = self._pair.source_with_answers_depth if own_depth else self._pair.performer.frame
        frames = np.stack([make(row) for row in self._weights]).astype(np.float32)
        count, n_vertices = frames.shape[:2]
        still = HeadMotion(np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)))
        deltas, details = np.empty_like(frames), np.empty_like(frames)
        for block, out in zip(self.source.decompose(frames, still, 0), (deltas, details), strict=True):
            block_to_frames(block, self.source.filter.position, out)
        gain = detail_gain(parameters, self.source.rest.smooth, self.target)
        coating = None
        if parameters.method == "coating":
            coating = CoatingDetails(self.source, self.target, deltas, details, gain, parameters.screening)
        built = Reconstruction(self.target, self._large, np.eye(count), gain, still, self.pose, coating)
        out = np.empty((count, n_vertices, 3), dtype=np.float32)
        built.frames(0, count, details, out)
        return out - self.pose.apply(self._large)


def _pipeline(pair: IctPair, weights: Array, bench: _Details, folder: Path, progress: Progress) -> Array:
    """Details ``(T, V, 3)`` of the result of all stages on these frames and the rest pose."""
    folder.mkdir(parents=True, exist_ok=True)
    write_mesh(folder / "source.ply", pair.source())
    write_mesh(folder / "target.ply", pair.target())
    shapes = [pair.source().vertices, *(pair.performer.frame(row) for row in weights)]
    np.save(folder / "frames.npy", np.stack(shapes).astype(np.float32))
    still = HeadMotion(np.tile(np.eye(3), (len(shapes), 1, 1)), np.zeros((len(shapes), 3)))
    take = Take(folder / "source.ply", folder / "frames.npy", weights, still)
    shot = run_with(make_shot(folder / "shot", take, folder / "target.ply", pair.feature_lines), progress)
    result = np.array(shot.array("result", "frames")[1:], dtype=np.float64)
    large = np.stack([bench.target.filter.smooth(np.ascontiguousarray(frame)) for frame in result])
    return np.asarray(result - large)
