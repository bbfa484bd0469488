"""The order of the stages, what each depends on, and running those that are not up to date."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from threadpoolctl import threadpool_limits

from toolkit.blocks import map_blocks
from toolkit.errors import InputError
from toolkit.progress import Progress, silent
from toolkit.shot import Shot
from toolkit.shot.hashing import key_of
from toolkit.stages import bases, decompose, inputs, register, result, transfer
from toolkit.stages.blocks import MapBlocks

__all__ = ["STAGES", "Stage", "StageReport", "current_key", "run_stages", "stage_parameters"]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Stage:
    """One step: what it is called, the stages and parameter tables it depends on, and its work.

    ``version`` is part of the key: raise it when the same inputs give other arrays. ``by_frames``: the work takes the
    frames block by block, on a `MapBlocks` that it is given. ``reads``: the files of the stage "inputs" that it depends
    on, beside the take, where those are not all: other picks or another target then leave it as it is.
    """

    name: str
    after: tuple[str, ...]
    tables: tuple[str, ...]
    work: Callable[..., None]
    version: int = 1
    by_frames: bool = False
    reads: tuple[str, ...] = ()


STAGES: dict[str, Stage] = {
    stage.name: stage
    for stage in (
        Stage("inputs", (), (), inputs.work, version=2),
        Stage("register", ("inputs",), ("register",), register.work, version=2),
        Stage(
            "decompose",
            ("inputs",),
            ("stabilise", "smoothing"),
            decompose.work,
            version=8,
            by_frames=True,
            reads=("source_vertices.npy", "source_triangles.npy"),
        ),
        Stage("bases", ("inputs", "decompose"), ("bases",), bases.work, version=6, reads=("lines.json",)),
        Stage("transfer", ("register", "bases"), ("smoothing", "transfer", "details"), transfer.work, version=3),
        Stage("result", ("transfer",), ("smoothing", "details"), result.work, version=5, by_frames=True),
    )
}


@dataclass(frozen=True)
class StageReport:
    """What happened to a stage: ``skipped`` if it was up to date, its ``numbers``, and the ``seconds`` it took."""

    stage: str
    skipped: bool
    seconds: float
    numbers: dict[str, Any]


def run_stages(
    shot: Shot,
    names: Sequence[str] | None = None,
    *,
    force: bool = False,
    progress: Progress = silent,
    map_blocks: MapBlocks = map_blocks,
) -> list[StageReport]:
    """Run the named stages (all by default) and whatever they need that is not up to date, in order.

    ``force`` runs the named ones even if they are up to date. ``map_blocks`` does the work of the frame stages: threads
    of this process, or `toolkit.cluster.Cluster.map_blocks`.
    """
    wanted = list(names) if names is not None else list(STAGES)
    for name in wanted:
        if name not in STAGES:
            raise InputError(f"there is no stage {name!r}", remedy=f"the stages are {', '.join(STAGES)}")
    needed = _with_earlier(wanted)
    shot.remove_leftovers()
    reports = []
    for name, stage in STAGES.items():
        if name in needed:
            reports.append(_run(shot, stage, force and name in wanted, progress, map_blocks))
    return reports


def current_key(shot: Shot, name: str) -> str:
    """The key that this stage has with the shot's present files and parameters."""
    stage = STAGES[name]
    parts: dict[str, Any] = {"stage": name, "version": stage.version}
    parts["after"] = {earlier: current_key(shot, earlier) for earlier in stage.after}
    if stage.reads and shot.is_current("inputs", parts["after"]["inputs"]):
        parts["after"]["inputs"] = _contents(shot, stage.reads)
    parts["parameters"] = stage_parameters(shot, stage.name)
    if name == "inputs":
        parts["files"] = {label: shot.hashes.of(path) for label, path in inputs.files(shot).items()}
        # Formats without a frame rate take it from here; the frames themselves do not depend on it.
        parts["fps"] = shot.config.source.fps
    if name == "result" and (edits := result.active_edits(shot)):
        parts["edits"] = [[edit.number, edit.kind, _edit_parts(shot, edit.data)] for edit in edits]
    return key_of(parts)


def _edit_parts(shot: Shot, data: dict[str, Any]) -> dict[str, Any]:
    """An edit without its note, and with the key of the shot that it copies from."""
    parts = {name: value for name, value in data.items() if name != "note"}
    other = shot.path / str(data.get("source_shot", ""))
    if "source_shot" in data and (other / "shot.toml").exists():
        parts["source_key"] = current_key(Shot(other), "transfer")
    return parts


def _contents(shot: Shot, names: Sequence[str]) -> dict[str, str]:
    """Hashes of the take and of some of what the stage "inputs" made."""
    made = shot.stage_folder("inputs")
    return {"frames": shot.hashes.of(shot.config.source.frames)} | {n: shot.hashes.of(made / n) for n in names}


def _run(shot: Shot, stage: Stage, force: bool, progress: Progress, map_blocks: MapBlocks) -> StageReport:
    key = current_key(shot, stage.name)
    if not force and shot.is_current(stage.name, key):
        manifest = shot.manifest(stage.name) or {}
        log.info("%s: up to date", stage.name)
        return StageReport(stage.name, True, 0.0, manifest.get("numbers", {}))
    log.info("%s: running", stage.name)
    began = time.perf_counter()
    # Threads of BLAS wait by spinning: on products as small as most are here they only take time from others.
    with threadpool_limits(1), shot.write_stage(stage.name, key, stage_parameters(shot, stage.name)) as folder:
        stage.work(shot, folder, progress, **({"map_blocks": map_blocks} if stage.by_frames else {}))
    seconds = time.perf_counter() - began
    log.info("%s: done in %.1f s", stage.name, seconds)
    return StageReport(stage.name, False, seconds, folder.numbers)


def stage_parameters(shot: Shot, name: str) -> dict[str, Any]:
    """The tables of parameters that a stage depends on."""
    return {table: asdict(getattr(shot.config, table)) for table in STAGES[name].tables}


def _with_earlier(names: Sequence[str]) -> set[str]:
    needed: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in needed:
            needed.add(name)
            waiting += STAGES[name].after
    return needed
