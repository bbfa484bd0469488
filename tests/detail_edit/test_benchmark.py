from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_benchmark_ends_with_its_figures_as_json() -> None:
    sizes = [
        "--vertices",
        "3000",
        "--frames",
        "40",
        "--region",
        "300",
        "--window",
        "12",
        "--bases",
        "3",
        "--runs",
        "1",
        "--json",
    ]
    script = ROOT / "benchmarks" / "detail_edit.py"
    done = subprocess.run([sys.executable, str(script), *sizes], capture_output=True, text=True, check=True)
    figures = json.loads(done.stdout.splitlines()[-1])
    assert list(figures)[-3:] == ["frame_s", "window_s", "back_substitution_s"]
    assert figures["region"] == 300
    assert 0 < figures["gradients_share_at_key"] < 1
