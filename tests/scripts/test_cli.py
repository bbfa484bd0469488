from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

STOPPED_WHILE_COMPILING = """
import signal, sys, time
sys.path.insert(0, "scripts")
signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever started the tests may ignore it
import _cli, numba
from numba.core import event

class Stop(event.Listener):
    def on_start(self, event):
        signal.raise_signal(getattr(signal, sys.argv[1]))
    def on_end(self, event):
        pass

@numba.njit
def more(x):
    return x + 1

def main(options, progress):
    with event.install_listener("numba:compile", Stop()):
        print("compiled", more(1), flush=True)
    time.sleep(60)
    return {}

sys.exit(_cli.run(_cli.parser_for(None, shot=False), main, []))
"""


def test_being_stopped_waits_for_the_compiler() -> None:
    """Raised among LLVM's callbacks it would be lost, or end the process on the spot."""
    for how in ("SIGINT", "SIGTERM"):
        command = [sys.executable, "-c", STOPPED_WHILE_COMPILING, how]
        done = subprocess.run(command, check=False, cwd=ROOT, capture_output=True, text=True, timeout=30)
        assert done.returncode == 130
        assert done.stdout == "compiled 2\n"
        assert done.stderr == "stopped; what was finished is kept\n"
