"""The measured processes: ``python -m benchmarks._scale.child stages|substitutions SHOT``, one line of JSON."""

from __future__ import annotations

import json
import os
import resource
import shutil
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from toolkit.shot import Shot
from toolkit.stages import run_stages

_STAGES = ("decompose", "bases", "transfer", "result")


def stages(shot: Shot) -> dict[str, Any]:
    """Run stages 2 to 5 as for the first time and say what they took; and, aside from that, reading and checking.

    What an earlier run left is removed before the clock starts: where files are discarded on the disk, too, flushes of
    the next stage wait half a second for a gigabyte that the last one replaced.
    """
    inputs = run_stages(shot, ["inputs"], force=True)[0].seconds
    run_stages(shot, ["register"])
    for stage in _STAGES:
        shutil.rmtree(shot.stage_folder(stage), ignore_errors=True)
    if hasattr(os, "sync"):
        os.sync()
    began = time.perf_counter()
    taken, cpu, bases = {}, {}, 0
    for stage in _STAGES:
        before = _cpu_seconds()
        report = run_stages(shot, [stage])[-1]
        taken[stage], cpu[stage] = report.seconds, _cpu_seconds() - before
        bases = report.numbers.get("bases", bases)
    seconds = time.perf_counter() - began
    said = {"total_s": seconds, "cpu_s": sum(cpu.values()), "stages": taken, "stages_cpu": cpu, "bases": bases}
    return said | {"inputs_s": inputs}


def _cpu_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _peak_memory() -> float:
    """The most memory that this process had, mapped files included, in bytes."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        return 1024.0 * int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1])
    except OSError:
        # On Linux this one would begin with what the parent had when it made us.
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0)


def substitutions(shot: Shot) -> dict[str, Any]:
    """Time the solves of the bases alone, with a factor of the shot's own system."""
    from toolkit.stages.transfer import open_system

    factor = open_system(shot).factor
    right = np.random.default_rng(1).normal(size=(factor.n, 3 * shot.array("bases", "weights").shape[1]))
    factor.solve(right)
    began = time.perf_counter()
    factor.solve(right)
    return {"seconds": time.perf_counter() - began}


def main() -> None:
    """Do what is asked for, in the order that a user's process would."""
    task, folder = sys.argv[1:]
    said = (stages if task == "stages" else substitutions)(Shot(folder))
    print(json.dumps({**said, "peak_gb": _peak_memory() / 2**30}))


if __name__ == "__main__":
    main()
