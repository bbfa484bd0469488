from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def viewer(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    clean = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-m", "viewer", *words]
    return subprocess.run(
        command, cwd=ROOT, env={**clean, **environment}, capture_output=True, text=True, timeout=240, check=False
    )


def test_help() -> None:
    done = viewer("--help")
    assert done.returncode == 0
    assert "--script" in done.stdout


def test_without_a_display_there_is_one_sentence(tmp_path: Path) -> None:
    done = viewer(str(tmp_path))
    assert done.returncode == 2
    assert "no display" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="DISPLAY is X11's")
def test_a_display_that_is_not_there_and_a_bad_shot(tmp_path: Path) -> None:
    done = viewer(str(tmp_path / "none"), DISPLAY=":54321", MIEN_NO_PROBE="1")
    assert done.returncode == 2
    assert "no such shot folder" in done.stderr
    from viewer.display import Probe

    before = os.environ.get("DISPLAY")
    os.environ["DISPLAY"] = ":54321"
    try:
        with pytest.raises(ValueError, match="cannot open a window on display ':54321'"):
            Probe().check()
    finally:
        os.environ.pop("DISPLAY")
        if before is not None:
            os.environ["DISPLAY"] = before
