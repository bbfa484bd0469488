#!/usr/bin/env python3
"""Run many shots, one after the other: a failure is noted, and the rest goes on.

Give shot folders, folders of shots, or lists. A list is a TOML file; its paths are relative to it, and [defaults] holds
what the shots have in common. A shot that is not there is made; one that is there is run as it is.

    [defaults]
    source_reference = "matt/neutral.obj"
    frames = "matt/take"
    feature_lines = "matt/lines.json"
    source_extras = ["matt/eyes.ply"]
    fps = 30

    [[shot]]
    folder = "shots/matt_hound"
    target = "hound.ply"
    landmarks = "matt_hound.json"

What two shots have in common is done once: the same performance on many targets is taken apart once, and the others
link its files.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from _cli import parser_for, run
from _workers import add_workers, frame_workers

from toolkit.errors import InputError
from toolkit.progress import Progress

if TYPE_CHECKING:
    from toolkit.shot import Shot
    from toolkit.stages.blocks import MapBlocks

PATHS = ("source_reference", "frames", "target", "landmarks", "feature_lines")
EXTRAS = ("source_extras", "target_extras")
_KINDS: dict[str, Any] = {"folder": str, "fps": (int, float)} | dict.fromkeys(PATHS, str) | dict.fromkeys(EXTRAS, list)


@dataclass
class Entry:
    """A shot of the batch; ``inputs`` as `create_shot` takes them, none for a shot that has to be there."""

    folder: Path
    inputs: dict[str, Any] = field(default_factory=dict)
    state: str = "waiting"
    seconds: float = 0.0
    note: str = ""
    numbers: dict[str, Any] = field(default_factory=dict)


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Make and run the shots, then say how each went."""
    from toolkit.shot import Shot

    entries = [entry for path in options.what for entry in entries_of(path)]
    for entry in entries:
        _guarded(entry, lambda entry=entry: _make(entry))
    done: list[Shot] = []
    there = [entry for entry in entries if entry.state != "failed"]
    with frame_workers(options, [entry.folder for entry in there]) as map_blocks:
        for number, entry in enumerate(there, 1):
            print(f"[{number}/{len(there)}] {entry.folder}", flush=True)
            _guarded(entry, lambda entry=entry: _run(entry, done, map_blocks, progress))
            if entry.state != "failed":
                done.append(Shot(entry.folder))
    _print_table(entries)
    shots = [
        {"shot": str(e.folder), "state": e.state, "seconds": e.seconds, "note": e.note, "numbers": e.numbers}
        for e in entries
    ]
    return {"failed": sum(entry.state == "failed" for entry in entries), "shots": shots}


def entries_of(path: Path) -> list[Entry]:
    """The shots that an argument stands for."""
    if path.is_file():
        return _listed(path)
    if (path / "shot.toml").exists():
        return [Entry(path)]
    found = sorted(toml.parent for toml in path.glob("*/shot.toml"))
    if not found:
        raise InputError(
            "this is neither a shot, nor a folder of shots, nor a list", where=path, remedy="see batch.py --help"
        )
    return [Entry(folder) for folder in found]


def _listed(path: Path) -> list[Entry]:
    from toolkit.shot.config import tomllib

    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"this is not TOML ({error})", where=path, remedy="see batch.py --help for a list") from None
    defaults, shots = data.get("defaults", {}), data.get("shot", [])
    tables = isinstance(defaults, dict) and isinstance(shots, list) and all(isinstance(shot, dict) for shot in shots)
    if not tables or not shots or set(data) - {"defaults", "shot"}:
        raise InputError("a list has [[shot]] tables, and [defaults]", where=path, remedy="see batch.py --help")
    return [_entry({**defaults, **shot}, path) for shot in shots]


def _entry(table: dict[str, Any], path: Path) -> Entry:
    unknown = set(table) - set(_KINDS)
    if unknown or "folder" not in table:
        what = f"there is no key {min(unknown)!r} of a shot" if unknown else "a shot has no folder"
        raise InputError(what, where=path, remedy=f"known are {', '.join(_KINDS)}")
    for key, value in table.items():
        if not isinstance(value, _KINDS[key]):
            raise InputError(f"{key} = {value!r} is of the wrong kind", where=path, remedy="see batch.py --help")
    inputs: dict[str, Any] = {key: path.parent / table[key] for key in PATHS if key in table}
    inputs |= {key: [path.parent / str(name) for name in table[key]] for key in EXTRAS if key in table}
    return Entry(path.parent / table["folder"], inputs | {"fps": table.get("fps")})


def _make(entry: Entry) -> None:
    from toolkit.shot.new import create_shot

    if (entry.folder / "shot.toml").exists():
        return
    missing = [key for key in PATHS[:3] if key not in entry.inputs]
    if missing:
        raise InputError(
            f"the shot is not there, and the list gives no {missing[0]}",
            where=entry.folder,
            remedy="add it to the list, or make the shot first",
        )
    create_shot(entry.folder, **entry.inputs)


def _run(entry: Entry, done: list[Shot], map_blocks: MapBlocks, progress: Progress) -> None:
    from toolkit.shot import Shot
    from toolkit.stages import run_stages
    from toolkit.stages.share import adopt_stages

    shot = Shot(entry.folder)
    # The keys of what follows depend on what this stage finds.
    first = run_stages(shot, ["inputs"], progress=progress)
    adopted = adopt_stages(shot, done)
    reports = run_stages(shot, progress=progress, map_blocks=map_blocks)
    entry.numbers = {report.stage: report.numbers for report in reports}
    entry.state = "up to date" if all(r.skipped for r in first + reports) and not adopted else "done"
    entry.note = f"shared: {', '.join(adopted)}" if adopted else ""


def _guarded(entry: Entry, work: Any) -> None:
    """Note what goes wrong with a shot, and go on."""
    began = time.perf_counter()
    try:
        work()
    except Exception as error:
        entry.state = "failed"
        entry.note = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    entry.seconds += time.perf_counter() - began


def _print_table(entries: list[Entry]) -> None:
    width = max(len(str(entry.folder)) for entry in entries)
    print(f"\n{'shot':<{width}}  {'state':<10} {'s':>7} {'frames':>7} {'bases':>6}")
    for entry in entries:
        frames = entry.numbers.get("inputs", {}).get("frames", "")
        bases = entry.numbers.get("bases", {}).get("bases", "")
        line = (
            f"{entry.folder!s:<{width}}  {entry.state:<10} {entry.seconds:>7.1f} {frames:>7} {bases:>6}  {entry.note}"
        )
        print(line.rstrip())


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = parser_for(__doc__, shot=False)
    made.add_argument("what", metavar="PATH", type=Path, nargs="+", help="a shot, a folder of shots, or a list (.toml)")
    add_workers(made)
    return made


if __name__ == "__main__":
    sys.exit(run(parser(), main))
