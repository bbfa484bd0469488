"""The measured processes: ``python -m benchmarks._scale.child stages|substitutions SHOT``, one line of JSON."""

from __future__ import annotations

import json
import resource
import sys
import time
from typing import Any

import numpy as np

from toolkit.shot import Shot
from toolkit.stages import run_stages

_STAGES = ("decompose", "bases", "transfer", "result")
# The bases are solved for once, and twice more for the contacts' sake (toolkit/large_scale.py).
_SOLVES = 3


def stages(shot: Shot) -> dict[str, Any]:
    """Run stages 2 to 5 anew and say what they took."""
    run_stages(shot, ["register"])
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_SELF)
    reports = run_stages(shot, _STAGES, force=True)
    seconds, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    taken = {report.stage: report.seconds for report in reports if report.stage in _STAGES}
    bases = next(report.numbers["bases"] for report in reports if report.stage == "bases")
    return {"total_s": seconds, "cpu_s": cpu, "stages": taken, "bases": bases}


def substitutions(shot: Shot) -> dict[str, Any]:
    """Time the solves of the bases alone, with a factor of the shot's own system."""
    from toolkit.stages.inputs import load_mesh
    from toolkit.transfer import DeformationTransfer, TransferParameters

    smooth, target = np.array(shot.array("decompose", "rest_smooth")), np.array(shot.array("transfer", "rest"))
    motion = np.array(shot.array("transfer", "motion"))
    plain = TransferParameters(feature_lines=False, contacts=False)
    system = DeformationTransfer(smooth, target, load_mesh(shot, "source").triangles, motion, parameters=plain)
    right = np.random.default_rng(1).normal(size=(len(smooth), 3 * shot.array("bases", "weights").shape[1]))
    system.factor.solve(right)
    began = time.perf_counter()
    for _ in range(_SOLVES):
        system.factor.solve(right)
    return {"seconds": time.perf_counter() - began}


def main() -> None:
    """Do what is asked for, in the order that a user's process would."""
    task, folder = sys.argv[1:]
    said = (stages if task == "stages" else substitutions)(Shot(folder))
    unit = 2**30 if sys.platform == "darwin" else 2**20
    print(json.dumps({**said, "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit}))


if __name__ == "__main__":
    main()
