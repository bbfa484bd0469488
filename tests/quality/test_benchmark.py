"""The quality benchmark as a user runs it; its sections measure, these tests only see that it runs and judges."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    script = str(ROOT / "benchmarks" / "quality.py")
    return subprocess.run([sys.executable, script, *arguments], capture_output=True, text=True, check=False)


def test_help_names_the_sections():
    shown = run("--help")
    assert shown.returncode == 0
    for word in ("reconstruction", "identity", "transfer", "figure3", "stillness", "wrinkles", "--register", "--ict"):
        assert word in shown.stdout


def test_without_the_ict_pair_the_section_says_so(tmp_path):
    done = run("--only", "wrinkles", "--work", str(tmp_path), "--json")
    assert done.returncode == 0, done.stderr
    assert "Skipped" in done.stdout
    last = json.loads(done.stdout.splitlines()[-1])
    assert last["goals"] == 0
    assert last["sections"]["wrinkles"]["rows"] == []


def test_a_wrong_folder_is_bad_input(tmp_path):
    done = run("--only", "wrinkles", "--ict", str(tmp_path))
    assert done.returncode == 2
    assert "bake.py" in done.stderr


def test_goals_are_judged_either_way():
    from benchmarks._quality.rows import Section, at_least, at_most, measured, table

    rows = (at_most("gap", 0.6, 0.5, "%"), at_least("likeness", 0.95, 0.9), measured("count", 3))
    assert [row.passed for row in rows] == [False, True, None]
    lines = table(Section("mouth", "what it is", rows)).splitlines()
    assert lines[-3].endswith("FAIL")
    assert lines[-2].endswith("PASS")
    assert lines[-1].split() == ["count", "3"]
    assert not at_most("unknown", float("nan"), 1.0).passed
