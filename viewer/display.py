"""Whether a window can be opened at all: tried in a child process, as a missing driver kills the process that asks."""

from __future__ import annotations

import os
import subprocess
import sys

from toolkit.errors import InputError

__all__ = ["Probe"]

_SECONDS = 60
_TRY = """
from open3d.visualization import gui
app = gui.Application.instance
app.initialize()
window = app.create_window("Mien", 64, 64, 0, 0)
ticks = 0
def tick():
    global ticks
    ticks += 1
    if ticks == 2:
        app.post_to_main_thread(window, app.quit)
    return False
window.set_on_tick_event(tick)
app.run()
"""


class Probe:
    """Begins to try when it is made, so that the shot can be read meanwhile; `check` waits for the answer."""

    def __init__(self) -> None:
        self._child: subprocess.Popen[str] | None = None
        if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
            raise InputError(
                "there is no display (DISPLAY is not set)",
                remedy="run it on a desktop, with ssh -X, or under Xvfb: xvfb-run -s '-screen 0 1600x1000x24' "
                "python -m viewer SHOT",
            )
        if os.environ.get("MIEN_NO_PROBE") != "1":
            self._child = subprocess.Popen(
                [sys.executable, "-c", _TRY], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
            )

    def check(self) -> None:
        """Raise InputError if no window can be opened."""
        if self._child is None:
            return
        try:
            _, words = self._child.communicate(timeout=_SECONDS)
        except subprocess.TimeoutExpired:
            self._child.kill()
            raise InputError(
                f"Open3D did not open a window within {_SECONDS} s", remedy="check the display and its driver"
            ) from None
        if self._child.returncode:
            raise InputError(_reason(words, self._child.returncode), remedy=_remedy())


def _reason(words: str, code: int) -> str:
    lines = [line.strip() for line in words.splitlines() if line.strip()]
    told = next((line for line in reversed(lines) if "rror" in line or "ailed" in line), lines[-1] if lines else "")
    display = os.environ.get("DISPLAY", "")
    return f"Open3D cannot open a window on display {display!r} (code {code}{': ' + told[:160] if told else ''})"


def _remedy() -> str:
    if sys.version_info >= (3, 13):
        return "check DISPLAY; Open3D 0.20 needs a Vulkan driver: apt-get install libvulkan1 mesa-vulkan-drivers"
    return "check DISPLAY, and that OpenGL works: apt-get install libgl1 libegl1 libgl1-mesa-dri"
