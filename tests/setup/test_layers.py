"""What may import what, and that nothing heavy happens at import."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FORBIDDEN = ("viewer", "scripts", "tests", "benchmarks", "tkinter", "open3d.visualization")


def imported(file):
    for node in ast.walk(ast.parse(file.read_text(), filename=str(file))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("file", sorted((ROOT / "toolkit").rglob("*.py")), ids=lambda f: str(f.relative_to(ROOT)))
def test_the_toolkit_knows_no_application(file):
    wrong = [name for name in imported(file) if name.startswith(tuple(f"{f}." for f in FORBIDDEN)) or name in FORBIDDEN]
    assert wrong == []


def test_importing_the_toolkit_is_light():
    code = "import sys, toolkit; print(*sorted({name.split('.')[0] for name in sys.modules}))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert not {"numpy", "scipy", "numba", "open3d", "pymeshlab", "matplotlib"} & set(result.stdout.split())


def test_numbered_scripts_are_not_imported_by_name():
    """``scripts.1_register`` is no identifier: what two scripts share lives in the toolkit or in scripts/common.py."""
    numbered = {f.stem for f in (ROOT / "scripts").glob("[0-9]*.py")}
    for file in [*ROOT.glob("scripts/*.py"), *ROOT.glob("viewer/**/*.py"), *ROOT.glob("benchmarks/*.py")]:
        assert not [name for name in imported(file) if any(part in numbered for part in name.split("."))]
