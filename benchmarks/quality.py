#!/usr/bin/env python3
"""Measure how good results are, and print it beside the goals.

Sections: reconstruction, identity, transfer, figure3, stillness, wrinkles. The samples have known answers: the same
expression on the other head. By default targets are given on the true correspondence, which leaves the registration
out; --register starts from the target's own mesh. wrinkles needs DIR, a folder with ict_performer/ and
targets/ict_identity/.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
for folder in (ROOT, ROOT / "scripts"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

from _cli import parser_for, run  # noqa: E402  (after the path is set)

from benchmarks._quality import identity, reconstruction, transfer, wrinkles  # noqa: E402
from benchmarks._quality.rows import Section, table  # noqa: E402
from benchmarks._quality.shots import sample_take  # noqa: E402
from data import ensure_samples  # noqa: E402
from toolkit.progress import Progress  # noqa: E402

SECTIONS = ("reconstruction", "identity", "transfer", "figure3", "stillness", "wrinkles")
TARGETS = ("asian_female", "african_old", "orc", "hound")


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = parser_for(__doc__, shot=False)
    made.add_argument("--only", nargs="+", choices=SECTIONS, default=SECTIONS, metavar="SECTION", help="run only these")
    made.add_argument("--targets", nargs="+", choices=TARGETS, default=TARGETS, metavar="NAME", help="sample targets")
    made.add_argument("--level", type=int, choices=(0, 1, 2), default=2, help="resolution of the samples (2: 68,949)")
    made.add_argument("--frames", type=int, help="so many frames of the performance, evenly spaced (all by default)")
    made.add_argument("--identity-level", type=int, choices=(0, 1, 2), default=1, help="resolution of identity (1)")
    made.add_argument("--identity-frames", type=int, default=40, help="frames of identity (40: each may be a basis)")
    made.add_argument("--register", action="store_true", help="register the targets instead of taking the truth")
    made.add_argument("--ict", type=Path, metavar="DIR", help="where ict_performer/ and targets/ict_identity/ lie")
    made.add_argument("--ict-frames", type=int, nargs="+", metavar="N", help="frames of the ICT take to compare")
    made.add_argument("--work", type=Path, help="keep the shots in this folder (a temporary one by default)")
    return made


def main(options: argparse.Namespace, progress: Progress) -> dict[str, Any]:
    """Run the sections, print their tables, return everything."""
    with tempfile.TemporaryDirectory(prefix="quality-") as temporary:
        work = options.work or Path(temporary)
        result = {}
        for section in _sections(options, work, progress):
            print(table(section), flush=True)
            result[section.name] = section.plain()
    judged = [row for one in result.values() for row in one["rows"] if row["passed"] is not None]
    passed = sum(row["passed"] for row in judged)
    print(f"\n{passed} of {len(judged)} goals reached")
    return {"sections": result, "passed": passed, "goals": len(judged)}


def _sections(options: argparse.Namespace, work: Path, progress: Progress) -> Iterator[Section]:
    wanted = options.only
    if "reconstruction" in wanted:
        samples = ensure_samples(progress=progress, targets=(), level=options.level)
        take = sample_take(samples.performer, work / "reconstruction", options.frames, wrinkles=True)
        yield reconstruction.section(take, [len(take.weights) // 3, 2 * len(take.weights) // 3], progress)
    if "identity" in wanted:
        samples = ensure_samples(progress=progress, targets=(), level=options.identity_level)
        take = sample_take(samples.performer, work / "identity", options.identity_frames, wrinkles=True)
        yield identity.section(take, samples.performer.feature_lines, work / "identity", progress)
    yield from _transfer_sections(options, work, progress)
    if "wrinkles" in wanted:
        yield wrinkles.section(options.ict, work / "wrinkles", options.ict_frames, progress)


def _transfer_sections(options: argparse.Namespace, work: Path, progress: Progress) -> Iterator[Section]:
    wanted = [name for name in ("transfer", "figure3", "stillness") if name in options.only]
    if not wanted:
        return
    samples = ensure_samples(progress=progress, targets=options.targets, level=options.level)
    for k, name in enumerate(options.targets):
        folder = work / name
        case = transfer.make_case(samples, name, folder, options.frames, registered=options.register)
        if "transfer" in wanted:
            yield transfer.transfer_section(case, folder, progress)
        if "figure3" in wanted:
            yield transfer.figure3_section(case, folder, progress)
        if "stillness" in wanted and k == 0:
            yield transfer.stillness_section(case, folder, len(case.full.weights) // 3, progress)


if __name__ == "__main__":
    sys.exit(run(parser(), main))
