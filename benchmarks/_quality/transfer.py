"""Sections "transfer" and "figure3": error on known answers, contacts, crossings, unrest, beside simpler methods."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks._quality.rows import Row, Section, at_most, measured
from benchmarks._quality.shots import (
    Take,
    face_height,
    known_answer,
    make_shot,
    run_with,
    sample_take,
    still_take,
    true_target,
)
from data.samples import SamplePaths
from data.targets import Truth
from toolkit.feature_lines import Opening, find_openings, load_feature_lines
from toolkit.progress import Progress
from toolkit.quality import (
    Jitter,
    contact_gaps,
    crossing_triangles,
    flipped_triangles,
    jitter,
    motion_error,
    rim_neighbourhood,
    unexplained_trembling,
    unrest,
    unsteadiness,
)
from toolkit.shot import Shot
from toolkit.stages.register import load_pose

__all__ = ["Case", "figure3_section", "make_case", "stillness_section", "transfer_section"]

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Frames = Sequence[NDArray] | NDArray

PLAIN = {"feature_lines": False, "contacts": False, "robust": False}
_NEAR_CM = 1.0
# Crossings and flips are counted in so many frames, evenly spaced: they cost more than the transfer itself.
_COUNTED = 31
# Trembling is measured on so many vertices, evenly chosen.
_TREMBLING = 8000


@dataclass(frozen=True)
class Case:
    """One target with its known answer, and the takes to carry over: with wrinkles and without."""

    name: str
    truth: Truth
    target: Path
    landmarks: Path | None
    lines: Path
    full: Take
    smooth: Take
    openings: list[Opening]
    near: Ids
    heights: tuple[float, float]

    def shot(self, folder: Path, take: Take) -> Shot:
        """A fresh shot of this case."""
        return make_shot(folder, take, self.target, self.lines, self.landmarks)


def make_case(samples: SamplePaths, name: str, folder: Path, count: int | None, *, registered: bool) -> Case:
    """Write the takes and the target of a case below ``folder``."""
    full = sample_take(samples.performer, folder / "full", count, wrinkles=True)
    smooth = sample_take(samples.performer, folder / "smooth", count, wrinkles=False)
    mesh, truth = full.mesh(), samples.truth(name)
    files = samples.targets[name]
    lines = files.feature_lines if registered else samples.performer.feature_lines
    openings = find_openings(load_feature_lines(samples.performer.feature_lines), mesh.vertices)
    rims = np.unique(np.concatenate([np.concatenate([o.upper, o.lower]) for o in openings]))
    distance = np.asarray(cKDTree(mesh.vertices[rims]).query(mesh.vertices)[0])
    landmarks = json.loads(samples.performer.landmarks.read_text(encoding="utf-8"))
    rest = truth.shape(np.zeros(52))
    return Case(
        name,
        truth,
        files.reference if registered else true_target(samples, name, mesh, folder),
        files.landmarks if registered else None,
        lines,
        full,
        smooth,
        openings,
        np.flatnonzero(distance < _NEAR_CM),
        (face_height(mesh.vertices, landmarks), face_height(rest, landmarks)),
    )


def transfer_section(case: Case, folder: Path, progress: Progress) -> Section:
    """Errors on the known answer beside simpler methods, then contacts, crossings and unrest of the full take."""
    shot = case.shot(folder / "smooth_shot", case.smooth)
    rows: list[Row] = []
    for label, parameters in (("Mien", {}), ("plain deformation transfer", PLAIN)):
        shot = run_with(shot, progress, transfer=parameters)
        rows += _rows_beside_truth(case, shot, label, shot.array("result", "frames"))
    rows += _rows_beside_truth(case, shot, "copied displacements", list(_copied(case, shot)))
    rows += _crossing_rows(case, "known answer", known_answer(shot, case.truth, case.smooth))
    shot = run_with(case.shot(folder / "full_shot", case.full), progress)
    label = "Mien with wrinkles"
    rows += _crossing_rows(case, "source with wrinkles", case.full.sequence().read(0, len(case.full.weights)))
    rows += _crossing_rows(case, label, shot.array("result", "frames"))
    rows += _contact_rows(case, shot, case.full, label, shot.array("result", "frames"), goals=True)
    rows += _unrest_rows(case, shot)
    about = (
        f"{case.name}, {len(case.full.weights)} frames. Errors: RMS |result - truth| / RMS |truth - rest| on the "
        "performance without relief and wrinkles, since the known answer has none; whole surface, details included; "
        "the error of the motion, so that of a registered rest pose is left out. "
        "The known answer adds the same offsets in centimetres to every human head, so copying displacements is "
        "nearly right by construction; it closes no lid. The goals of contacts and of unrest are judged on the "
        "performance with wrinkles. Trembling is what fourth differences in time have beside first ones. Second "
        "differences scaled by the faces' size grow with a lid that has farther to close or a longer jaw, as the known "
        "answer's do; scaled by how fast each vertex moves on either face they don't."
    )
    return Section(f"transfer onto {case.name}", about, tuple(rows))


def figure3_section(case: Case, folder: Path, progress: Progress) -> Section:
    """The four combinations of feature lines and contacts."""
    shot = case.shot(folder / "smooth_shot", case.smooth)
    rows: list[Row] = []
    for lines in (False, True):
        for contacts in (False, True):
            label = f"lines {'on ' if lines else 'off'} contacts {'on ' if contacts else 'off'}"
            shot = run_with(shot, progress, transfer={"feature_lines": lines, "contacts": contacts})
            rows += _rows_beside_truth(case, shot, label, shot.array("result", "frames"))
    about = f"{case.name}: the paper's Figure 3 in numbers, on the performance without wrinkles."
    return Section(f"figure 3 on {case.name}", about, tuple(rows))


def stillness_section(case: Case, folder: Path, frame: int, progress: Progress) -> Section:
    """A source that holds still must give a result that does."""
    rows = []
    for label, chosen in (("an expression", frame), ("the rest pose", 0)):
        take = still_take(case.full, folder / "still", chosen, 40)
        shot = run_with(case.shot(folder / "still_shot", take), progress)
        rows.append(at_most(f"{label} held: movement of the result", unrest(shot.array("result", "frames")), 0.0))
    return Section("stillness", f"{case.name}, one frame held for 40 frames; in the target's unit.", tuple(rows))


def _rows_beside_truth(case: Case, shot: Shot, label: str, frames: Frames) -> list[Row]:
    """Errors, open contacts and crossings of a result of the take without wrinkles."""
    return [
        *_error_rows(case, shot, label, frames),
        *_contact_rows(case, shot, case.smooth, label, frames, goals=False),
        *_crossing_rows(case, label, frames),
    ]


def _error_rows(case: Case, shot: Shot, label: str, frames: Frames) -> list[Row]:
    rest = case.truth.shape(np.zeros(52))
    # The motion is judged, not the registration: with --register the two rest poses differ.
    shift = rest - np.array(shot.array("register", "target_vertices"))
    steady = [frame + shift for frame in _steady(shot, case.smooth, frames)]
    truth = [case.truth.shape(w) for w in case.smooth.weights]
    whole = motion_error(steady, truth, rest)
    near = motion_error(steady, truth, rest, case.near)
    triangles = case.smooth.mesh().triangles
    flips = max(len(flipped_triangles(truth[t], steady[t], triangles)) for t in _counted(len(steady)))
    return [
        measured(f"{label}: error over motion, whole head", 100 * whole.relative, "%"),
        measured(f"{label}: error over motion, 1 cm round lips and lids", 100 * near.relative, "%"),
        measured(f"{label}: RMS error", 100 * whole.rms / case.heights[1], "% face"),
        measured(f"{label}: flipped triangles, worst frame", flips),
    ]


def _steady(shot: Shot, take: Take, frames: Iterable[NDArray]) -> Iterator[Array]:
    placed = take.motion.seen_from(load_pose(shot))
    for t, frame in enumerate(frames):
        yield (np.asarray(frame, dtype=np.float64) - placed.translations[t]) @ placed.rotations[t]


def _copied(case: Case, shot: Shot) -> Iterator[Array]:
    """The source's displacements, turned and scaled to the target and added to it, with the head's motion put on."""
    pose = load_pose(shot)
    target = np.array(shot.array("register", "target_vertices"))
    rest = case.smooth.mesh().vertices
    placed = case.smooth.motion.seen_from(pose)
    for t, frame in enumerate(case.smooth.sequence().read(0, len(case.smooth.weights))):
        steady = (frame - case.smooth.motion.translations[t]) @ case.smooth.motion.rotations[t]
        moved = target + pose.scale * (steady - rest) @ pose.rotation.T
        yield moved @ placed.rotations[t].T + placed.translations[t]


def _contact_rows(
    case: Case, shot: Shot, take: Take, label: str, result: Iterable[NDArray], *, goals: bool
) -> list[Row]:
    """Worst excess gap of each opening over all frames, in percent of the face's height."""
    rows = []
    rest, own = take.mesh().vertices, np.array(shot.array("register", "target_vertices"))
    source = take.sequence().read(0, len(take.weights))
    for opening in case.openings:
        gaps = contact_gaps(opening, source, result, rest, own, *case.heights)
        name = f"{label}: {opening.name}, largest gap where the source touches"
        worst = 100 * gaps.worst
        rows.append(at_most(name, worst, 0.5, "% face") if goals else measured(name, worst, "% face"))
        if goals:
            rows.append(measured(f"{label}: {opening.name}, frames in which the source closes it", gaps.closed_frames))
    return rows


def _crossing_rows(case: Case, label: str, frames: Iterable[NDArray]) -> list[Row]:
    triangles = case.full.mesh().triangles
    near = np.unique(np.concatenate([rim_neighbourhood(opening, triangles) for opening in case.openings]))
    chosen = set(_counted(len(case.full.weights)).tolist())
    counts = [len(crossing_triangles(frame, triangles, near)) for t, frame in enumerate(frames) if t in chosen]
    return [
        measured(f"{label}: crossing triangles round lips and lids, mean", float(np.mean(counts))),
        measured(f"{label}: crossing triangles round lips and lids, worst frame", max(counts)),
    ]


def _counted(n_frames: int) -> Ids:
    return np.unique(np.linspace(0, n_frames - 1, min(_COUNTED, n_frames)).round().astype(np.int64))


def _unrest_rows(case: Case, shot: Shot) -> list[Row]:
    """Trembling of the result beside the performer's, and of the known answer beside its own, without head motion."""
    pose = load_pose(shot)
    rest, height = case.smooth.mesh().vertices, case.heights[0]
    some = np.unique(np.linspace(0, len(rest) - 1, min(_TREMBLING, len(rest))).astype(int))
    full, plain = (_held_still(take)[:, some] for take in (case.full, case.smooth))
    truth = np.stack([case.truth.shape(w)[some] for w in case.smooth.weights])
    result = np.stack([frame[some] for frame in _steady(shot, case.full, shot.array("result", "frames"))])
    rows = []
    for name, source, moved in (("result", full, result), ("known answer", plain, truth)):
        found = jitter(unsteadiness(source), unsteadiness(moved), pose.scale, rest[some], height)
        share = 100 * unexplained_trembling(source, moved)
        label = f"trembling of the {name}: "
        unexplained = label + "share that no motion of the source explains"
        rows += [
            at_most(unexplained, share, 10, "%") if name == "result" else measured(unexplained, share, "%"),
            measured(label + "the same share of the source", 100 * unexplained_trembling(source, source), "%"),
            measured(label + "over source, by how much each moves", found.whole),
            measured(label + "over source, typical part of the face", found.typical),
            measured(label + "over source, worst tenth of the parts", found.worst),
            *_second_differences(name, found),
        ]
    noise = np.random.default_rng(0).normal(scale=1e-5 * height, size=full.shape)
    label = "trembling of the source with noise of 1e-5 of the face's height: share"
    return [*rows, measured(label, 100 * unexplained_trembling(full, full + noise), "%")]


def _second_differences(name: str, found: Jitter) -> list[Row]:
    """The result's against their goal; a known answer's own say what the target's anatomy alone does to them."""
    judge = partial(at_most, goal=1.0) if name == "result" else measured
    label = f"second differences of the {name} over the source's, "
    return [
        judge(label + "scaled by the faces' size", found.bend),
        judge(label + "by how fast each vertex moves", found.paced),
    ]


def _held_still(take: Take) -> Array:
    frames, motion = take.sequence().read(0, len(take.weights)), take.motion
    return np.stack([(f - motion.translations[t]) @ motion.rotations[t] for t, f in enumerate(frames)])
