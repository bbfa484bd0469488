"""Gather a shot's report from what its stages left."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from toolkit.feature_lines import find_openings
from toolkit.progress import Progress, silent
from toolkit.quality import ContactGaps, contact_gaps, detail_energy, jitter, unsteadiness
from toolkit.rendering.shots import ShotViews, expressive_frames, open_views
from toolkit.rendering.takes import View, performance_sheet
from toolkit.report import sections
from toolkit.report.data import Figure, ReportData, Section
from toolkit.report.edits import edits_section
from toolkit.report.maps import shot_registration_figures
from toolkit.report.pictures import bases_figures, coating_figures, motion_figures
from toolkit.shot import Shot
from toolkit.stages import STAGES
from toolkit.stages.decompose import source_decomposer
from toolkit.stages.inputs import load_lines
from toolkit.stages.register import load_target

__all__ = ["report_data", "result_links"]

Vector = tuple[float, float, float]
_UNIT = "unit of the file"
_SAMPLE = 8000


def report_data(
    shot: Shot,
    *,
    forward: Vector = (0.0, 0.0, 1.0),
    up: Vector = (0.0, 1.0, 0.0),
    frames: int = 7,
    folder: Path | None = None,
    progress: Progress = silent,
) -> ReportData:
    """Render and measure what the report shows; the stages must have been run.

    ``folder`` is where the report will lie, the shot's own by default.
    """
    views = open_views(shot, forward=forward, up=up)
    chosen = expressive_frames(shot, frames)
    steps = (
        lambda: _performance(views, chosen),
        lambda: _registration(shot, views),
        lambda: _decomposition(shot, views, chosen),
        lambda: _bases(shot, views),
        lambda: _transfer(shot, views, chosen),
        lambda: _details(shot),
        lambda: edits_section(shot, views),
        lambda: _timings(shot),
        lambda: _parameters(shot),
    )
    made = _checks(shot)
    for done, step in enumerate(steps, start=1):
        section = step()
        made += [] if section is None else [section]
        progress("making the report", done, len(steps))
    subtitle = f"{views.source.n_frames} frames at {views.fps:g} a second · {len(views.source.rest):,} vertices"
    return ReportData(
        f"{views.target.label}: facial performance transfer",
        subtitle,
        _summary(shot),
        made,
        result_links(shot, folder or shot.path),
    )


def _performance(views: ShotViews, chosen: list[int]) -> Section:
    sheet = performance_sheet([views.source, views.target], chosen, width=300)
    return sections.performance_section([Figure(sheet, wide=True)])


def _registration(shot: Shot, views: ShotViews) -> Section:
    return sections.registration_section(shot_registration_figures(shot, views), _numbers(shot, "register"))


def _decomposition(shot: Shot, views: ShotViews, chosen: list[int]) -> Section:
    energy = np.array(shot.array("decompose", "detail_energy"))
    wrinkled = chosen[int(np.argmax(energy[chosen]))]
    figures = coating_figures(views.source, wrinkled, source_decomposer(shot).filter, _UNIT)
    return sections.decomposition_section(figures, _numbers(shot, "decompose"))


def _bases(shot: Shot, views: ShotViews) -> Section:
    frames = np.array(shot.array("bases", "frames"))
    rest, deltas = source_decomposer(shot).rest.smooth, shot.array("decompose", "smooth_deltas")
    source = np.array([rest + deltas[t] for t in frames]).reshape(-1, *rest.shape)
    # The bases were solved in the source's pose and size, so the source's axes serve for both.
    target = View(
        "", views.source.triangles, load_target(shot).vertices, len(frames), lambda t: rest, views.target.material,
        views.source.forward, views.source.up, views.source.focus,
    )  # fmt: skip
    bases = np.array(shot.array("transfer", "bases"))
    return sections.bases_section(
        bases_figures([(views.source, source), (target, bases)], frames),
        np.array(shot.array("bases", "weights")),
        np.array(shot.array("bases", "errors")),
        _UNIT,
        _numbers(shot, "bases"),
    )


def _transfer(shot: Shot, views: ShotViews, chosen: list[int]) -> Section:
    deltas = shot.array("decompose", "smooth_deltas")
    strongest = max(chosen, key=lambda t: float(np.abs(deltas[t]).max()))
    numbers: dict[str, Any] = dict(_numbers(shot, "transfer"))
    numbers |= _trembling(views)
    gaps = _gaps(shot, views)
    for gap in gaps:
        if gap.touching.any():
            numbers[f"largest gap of {gap.name}, % of the face, where the source's touches"] = 100 * gap.worst
    curves = {gap.name: {"source": 100 * gap.source_mean, "result": 100 * gap.mean} for gap in gaps}
    return sections.transfer_section(
        motion_figures([views.source, views.target], strongest, views.face_heights), curves, numbers
    )


def _trembling(views: ShotViews) -> dict[str, float]:
    """How much the result trembles beside the source, on an even choice of vertices."""
    rest = views.source.rest
    some = np.unique(np.linspace(0, len(rest) - 1, min(_SAMPLE, len(rest))).astype(int))
    takes = [unsteadiness(view.frame(t)[some] for t in range(view.n_frames)) for view in views.steady()]
    height, other = views.face_heights
    found = jitter(takes[0], takes[1], other / height, rest[some], height)
    return {"jitter_beside_source": found.whole, "jitter_of_the_worst_parts_beside_source": found.worst}


def _gaps(shot: Shot, views: ShotViews) -> list[ContactGaps]:
    openings = find_openings(load_lines(shot), views.source.rest)
    rest, own = views.source.rest, views.target.rest
    return [
        contact_gaps(opening, _frames(views.source), _frames(views.target), rest, own, *views.face_heights)
        for opening in openings
    ]


def _frames(view: View) -> Iterator[NDArray[np.floating]]:
    return (view.frame(t) for t in range(view.n_frames))


def _details(shot: Shot) -> Section:
    gain = np.array(shot.array("transfer", "gain"))
    energy = detail_energy(shot.array("decompose", "details"), gain)
    numbers = {"gain": shot.config.details.gain, "method": shot.config.details.method}
    return sections.details_section(np.array(shot.array("decompose", "detail_energy")), energy, _UNIT, numbers)


def _timings(shot: Shot) -> Section:
    manifests = {name: shot.manifest(name) for name in STAGES}
    return sections.timings_section({name: float(m["seconds"]) for name, m in manifests.items() if m})


def _numbers(shot: Shot, stage: str) -> Mapping[str, Any]:
    numbers = (shot.manifest(stage) or {}).get("numbers", {})
    return numbers if isinstance(numbers, Mapping) else {}


def _summary(shot: Shot) -> dict[str, Any]:
    config = shot.config
    files = {
        "source mesh": config.source.reference.name,
        "take": config.source.frames.name,
        "target mesh": config.target.reference.name,
    }
    return {**files, **{key: value for key, value in _numbers(shot, "inputs").items() if key != "findings"}}


def _checks(shot: Shot) -> list[Section]:
    """What the checks found in the input, if anything."""
    findings = [str(text) for text in _numbers(shot, "inputs").get("findings", [])]
    intro = "What the checks found in the files; what could be repaired safely was repaired."
    return [Section("Input checks", intro, notes=findings)] if findings else []


def _parameters(shot: Shot) -> Section:
    tables: dict[str, Any] = {}
    for stage in STAGES:
        tables |= (shot.manifest(stage) or {}).get("parameters", {})
    return Section("Parameters", "As the stages last ran; change them in shot.toml.", numbers=tables, judged=False)


def result_links(shot: Shot, folder: Path) -> list[tuple[str, str]]:
    """What was made of the shot, by addresses relative to the report's folder, so that both can be moved together."""
    found: list[Path] = [shot.frames_path]
    for made in (shot.export_folder, shot.render_folder):
        found += sorted(made.iterdir()) if made.is_dir() else []
    way = Path(os.path.relpath(shot.path.resolve(), folder.resolve()))
    names = [path.relative_to(shot.path) for path in found if path.exists()]
    return [(name.as_posix(), quote((way / name).as_posix())) for name in names]
