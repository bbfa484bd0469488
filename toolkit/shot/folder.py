"""Reading and writing a shot folder: stages with their manifests, the result, and what is up to date.

A stage is a folder of ``.npy`` arrays and a ``manifest.json``. It is written aside and renamed into place, so a killed
process leaves either the old stage or the new.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from toolkit.errors import InputError
from toolkit.meshio.aside import folder_aside
from toolkit.meshio.leftovers import remove_leftovers
from toolkit.meshio.npy import write_array
from toolkit.shot.config import ShotConfig, load_config
from toolkit.shot.hashing import HashCache

__all__ = ["Shot", "StageFolder"]

_MANIFEST = "manifest.json"


@dataclass
class StageFolder:
    """A stage while it is being written: arrays go in, ``numbers`` end up in its manifest."""

    path: Path
    numbers: dict[str, Any] = field(default_factory=dict)

    def save(self, name: str, array: NDArray[Any]) -> None:
        """Store an array as ``<name>.npy``."""
        write_array(self.path / f"{name}.npy", array)

    def create(self, name: str, shape: tuple[int, ...], dtype: DTypeLike = np.float32) -> NDArray[Any]:
        """A new memory-mapped array ``<name>.npy`` to be filled block by block."""
        return np.lib.format.open_memmap(self.path / f"{name}.npy", mode="w+", dtype=dtype, shape=shape)

    def array(self, name: str) -> NDArray[Any]:
        """An array that is there already, memory-mapped and read-only."""
        loaded: NDArray[Any] = np.load(self.path / f"{name}.npy", mmap_mode="r")
        return loaded


class Shot:
    """One performance and one target on disk; see the README for the folder's contract."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.is_dir():
            raise InputError("there is no such shot folder", where=self.path, remedy="make it with scripts/new_shot.py")
        self.config: ShotConfig = load_config(self.path / "shot.toml")
        self.hashes = HashCache(self.path / "stages" / "hashes.json")

    @property
    def landmarks_path(self) -> Path:
        """``landmarks.json``."""
        return self.path / "landmarks.json"

    @property
    def feature_lines_path(self) -> Path:
        """``feature_lines.json``."""
        return self.path / "feature_lines.json"

    @property
    def edits_path(self) -> Path:
        """``edits.jsonl``, the journal of edits."""
        return self.path / "edits.jsonl"

    @property
    def regions_path(self) -> Path:
        """``regions.json``, parts of the face that users have named."""
        return self.path / "regions.json"

    @property
    def drafts_path(self) -> Path:
        """``drafts.json``, the viewer's edits that are not in the journal yet."""
        return self.path / "drafts.json"

    @property
    def frames_path(self) -> Path:
        """``result/frames.npy`` (T, V, 3) float32, in the target's unit and place."""
        return self.path / "result" / "frames.npy"

    @property
    def export_folder(self) -> Path:
        """``export/``."""
        return self.path / "export"

    @property
    def render_folder(self) -> Path:
        """``render/``."""
        return self.path / "render"

    @property
    def report_path(self) -> Path:
        """``report.html``."""
        return self.path / "report.html"

    def stage_folder(self, stage: str) -> Path:
        """Where a stage's arrays lie; the last stage's are the result."""
        return self.path / "result" if stage == "result" else self.path / "stages" / stage

    def manifest(self, stage: str) -> dict[str, Any] | None:
        """A finished stage's manifest, or None."""
        try:
            manifest = json.loads((self.stage_folder(stage) / _MANIFEST).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return manifest if isinstance(manifest, dict) else None

    def is_current(self, stage: str, key: str) -> bool:
        """Whether the stage was finished from exactly these inputs, and its files are still there, each in full."""
        manifest = self.manifest(stage)
        if manifest is None or manifest.get("key") != key or "files" not in manifest:
            return False
        folder = self.stage_folder(stage)
        return all(_size(folder / name) == size for name, size in manifest["files"].items())

    def array(self, stage: str, name: str) -> NDArray[Any]:
        """A stage's array, memory-mapped and read-only."""
        path = self.stage_folder(stage) / f"{name}.npy"
        if not path.exists():
            raise InputError(
                f"the stage {stage!r} has not been run", where=self.path, remedy=f"run scripts/run_all.py {self.path}"
            )
        try:
            loaded: NDArray[Any] = np.load(path, mmap_mode="r")
        except (ValueError, EOFError) as error:
            remedy = f"run scripts/run_all.py {self.path}, which makes it anew"
            raise InputError(f"is damaged or cut short ({error})", where=path, remedy=remedy) from error
        return loaded

    @contextmanager
    def write_stage(self, stage: str, key: str, parameters: dict[str, Any]) -> Iterator[StageFolder]:
        """Write a stage aside; it takes the old one's place when the block ends without an error."""
        began = time.perf_counter()
        with folder_aside(self.stage_folder(stage)) as folder:
            writing = StageFolder(folder)
            yield writing
            manifest = {
                "stage": stage,
                "key": key,
                "parameters": parameters,
                "files": {file.name: file.stat().st_size for file in sorted(folder.iterdir())},
                "numbers": writing.numbers,
                "seconds": round(time.perf_counter() - began, 3),
            }
            (folder / _MANIFEST).write_text(json.dumps(manifest, indent=1, default=float) + "\n", encoding="utf-8")
        self.hashes.save()

    def remove_leftovers(self) -> None:
        """Delete what killed processes left half written."""
        for folder in (self.path, self.path / "stages", self.export_folder, self.render_folder):
            remove_leftovers(folder)


def _size(path: Path) -> int:
    """Bytes of a file, -1 if there is none."""
    try:
        return path.stat().st_size
    except OSError:
        return -1
