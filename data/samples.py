"""The samples as ordinary files on disk: built once, checked by a hash of what made them, then found again."""

from __future__ import annotations

import hashlib
import logging
import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from data.package import SHA256, Package, default_cache, ensure_wheel
from data.targets import TARGETS, Truth, build_target
from toolkit.errors import InputError
from toolkit.progress import Progress, silent

__all__ = ["PerformerPaths", "SamplePaths", "TargetPaths", "build_samples", "ensure_samples"]


log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PerformerPaths:
    """The performer's files, all in centimetres, Y up, face to +Z.

    ``reference`` OBJ of quads, the neutral; ``frames`` .npy (T, V, 3) float32 with the head's motion; ``weights``
    .npy (T, 52) and ``head_motion`` .npz, from which the frames were made; ``shapes`` .npz names, neutral and offsets
    of the 52 shapes at the control points; ``subdivision`` .npz the (V, 4326) matrix; ``feature_lines`` and
    ``landmarks`` JSON, by vertex id; ``eyes`` PLY of the eyeballs at rest, for pictures.
    """

    reference: Path
    frames: Path
    weights: Path
    head_motion: Path
    shapes: Path
    subdivision: Path
    feature_lines: Path
    landmarks: Path
    eyes: Path
    fps: float = 30.0


@dataclass(frozen=True)
class TargetPaths:
    """One target's files.

    ``reference`` PLY; ``truth`` .npz, read by ``Truth.load``; ``landmarks`` (45 pairs on the face), ``landmarks_30``,
    ``landmarks_head`` (the 45, ears, skull and neck) and ``feature_lines`` JSON in the shot folder's format, with
    ``target_vertices`` added to each line, and guides for the registration; ``eyes`` PLY of the eyeballs, for pictures.
    """

    reference: Path
    truth: Path
    landmarks: Path
    landmarks_30: Path
    landmarks_head: Path
    feature_lines: Path
    eyes: Path


@dataclass(frozen=True)
class SamplePaths:
    """Where everything is."""

    root: Path
    performer: PerformerPaths
    targets: dict[str, TargetPaths]

    def truth(self, name: str) -> Truth:
        """Return the known answer on one target, e.g. ``truth("hound").shape(weights)`` (V, 3) in its file's unit."""
        return Truth.load(self.targets[name].truth, self.performer.subdivision)


def ensure_samples(
    cache_dir: Path | str | None = None,
    progress: Progress = silent,
    targets: Sequence[str] = ("asian_female", "hound"),
    level: int = 2,
) -> SamplePaths:
    """Return the samples, downloading and building what is not in the cache yet.

    Parameters
    ----------
    cache_dir : where to keep the download and the results; ``data/cache`` without it
    targets : names among ``data.TARGETS``
    level : 2 for the full resolution (68,949 vertices), 1 (17,259) or 0 (4,326) for quick tests

    Raises ``InputError`` if the package can't be had (see ``ensure_wheel``) or a name is unknown.
    """
    cache = Path(cache_dir) if cache_dir is not None else default_cache()
    root = cache / f"level{level}-{fingerprint()}"
    paths = build_samples(root, progress, targets, level, cache)
    _tell_of_older(cache, f"level{level}-*", root)
    return paths


def _tell_of_older(cache: Path, pattern: str, current: Path) -> None:
    """Shots may still point to what an older version of the code built, so it is left to the user to remove."""
    for older in sorted(path for path in cache.glob(pattern) if path != current):
        log.info("%s is of an older version; remove it once no shot refers to it", older)


def build_samples(
    root: Path, progress: Progress, targets: Sequence[str], level: int, cache: Path | None = None
) -> SamplePaths:
    """Build into ``root`` what is not there yet: ``performer/`` and ``targets/<name>/``."""
    if level not in (0, 1, 2):
        raise InputError(f"there is no sample of level {level}", remedy="use 0, 1 or 2")
    for name in targets:
        if name not in TARGETS:
            raise InputError(f"there is no sample target {name!r}", remedy=f"use one of {', '.join(TARGETS)}")
    opened: list[Package] = []

    def package() -> Package:
        if not opened:
            opened.append(Package(ensure_wheel(cache or default_cache(), progress)))
        return opened[0]

    from data.performer import build_performer

    _once(root / "performer", lambda folder: build_performer(package(), level, folder, progress))
    for k, name in enumerate(targets):
        progress(f"building the target {name}", k, len(targets))
        _once(root / "targets" / name, lambda folder: build_target(package(), name, level, folder))  # noqa: B023  (called at once)
        progress(f"building the target {name}", k + 1, len(targets))
    return _paths(root, targets)


def _once(folder: Path, build: Callable[[Path], None]) -> None:
    """Build a folder aside and rename it into place, unless it is there."""
    if folder.exists():
        return
    folder.parent.mkdir(parents=True, exist_ok=True)
    aside = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}-"))
    try:
        build(aside)
        aside.chmod(0o755)
        try:
            aside.rename(folder)
        except OSError:
            if not folder.exists():
                raise
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _paths(root: Path, targets: Sequence[str]) -> SamplePaths:
    performer = root / "performer"
    held = PerformerPaths(
        reference=performer / "reference.obj",
        frames=performer / "frames.npy",
        weights=performer / "weights.npy",
        head_motion=performer / "head_motion.npz",
        shapes=performer / "shapes.npz",
        subdivision=performer / "subdivision.npz",
        feature_lines=performer / "feature_lines.json",
        landmarks=performer / "landmarks.json",
        eyes=performer / "eyes.ply",
    )
    found = {}
    for name in targets:
        folder = root / "targets" / name
        found[name] = TargetPaths(
            reference=folder / "reference.ply",
            truth=folder / "truth.npz",
            landmarks=folder / "landmarks.json",
            landmarks_30=folder / "landmarks_30.json",
            landmarks_head=folder / "landmarks_head.json",
            feature_lines=folder / "feature_lines.json",
            eyes=folder / "eyes.ply",
        )
    return SamplePaths(root, held, found)


def fingerprint() -> str:
    """Twelve hex digits of all that decides the samples' bytes: this package's code and picks, and the wheel."""
    here = Path(__file__).resolve().parent
    digest = hashlib.sha256(SHA256.encode())
    for path in sorted([*here.glob("*.py"), *(here / "samples").glob("*.json")]):
        digest.update(path.name.encode() + b"\0" + path.read_bytes().replace(os.linesep.encode(), b"\n"))
    return digest.hexdigest()[:12]
