from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from toolkit.meshio import leftovers
from toolkit.meshio.aside import folder_aside, written_aside
from toolkit.meshio.leftovers import remove_leftovers

WRITING = """
import sys
from pathlib import Path
from toolkit.meshio.aside import folder_aside, written_aside
place = Path(sys.argv[1])
with written_aside(place / "take.obj") as file, folder_aside(place / "frames") as folder:
    file.write_text("half")
    (folder / "one.obj").write_text("half")
    print("writing", flush=True)
    sys.stdin.read()
"""


def test_only_what_a_dead_process_left_is_removed(tmp_path: Path) -> None:
    kept = [tmp_path / name for name in ("take.obj", ".hidden", ".notes.part", ".of.mine.party")]
    for file in kept:
        file.write_text("mine")
    (tmp_path / ".old.0123abcd.part.npy").write_text("as names were once")
    command = [sys.executable, "-c", WRITING, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "writing\n"
        remove_leftovers(tmp_path)
        writing = set(tmp_path.glob(".*.part*")) - set(kept)
        assert sorted(path.is_dir() for path in writing) == [False, True]
        process.kill()
    assert set(tmp_path.iterdir()) == writing | set(kept)
    remove_leftovers(tmp_path)
    assert set(tmp_path.iterdir()) == set(kept)
    remove_leftovers(tmp_path / "nowhere")


@pytest.mark.parametrize("aside", [written_aside, folder_aside])
def test_what_another_machine_writes_is_left_alone(aside, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as elsewhere:
        elsewhere.setattr(leftovers.socket, "gethostname", lambda: "elsewhere")
        elsewhere.setattr(leftovers.os, "getpid", lambda: 2**22 + 1)  # there is none here
        writing = aside(tmp_path / "take.npy")
        temporary = writing.__enter__()
        temporary.touch(exist_ok=True)
    remove_leftovers(tmp_path)
    assert temporary.exists()
    writing.__exit__(None, None, None)
    assert [path.name for path in tmp_path.iterdir()] == ["take.npy"]
