from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_benchmark_ends_with_its_figures_as_json() -> None:
    sizes = {"vertices": 2000, "frames": 40, "window": 12, "bases": 3, "points": 3, "runs": 1, "coarse": 500}
    options = [word for name, value in sizes.items() for word in (f"--{name}", str(value))]
    script = ROOT / "benchmarks" / "pose_edit.py"
    done = subprocess.run([sys.executable, str(script), *options, "--json"], capture_output=True, text=True, check=True)
    figures = json.loads(done.stdout.splitlines()[-1])
    assert list(figures)[-4:] == ["frame_s", "window_s", "take_s", "back_substitution_s"]
    assert (figures["window"], figures["frames"], figures["points"]) == (12, 40, 3)
    # The decimated answer is another one, yet not a wholly different one.
    assert 1e-3 < figures["coarse_differs"] < 0.6
    assert figures["coarse_differs_rms"] < 0.5 * figures["coarse_differs"]
