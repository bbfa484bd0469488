"""What all scripts share: options, progress, logging, exit codes, one JSON line at the end.

Exit codes: 0 done, 1 failed, 2 bad usage or bad input, 130 stopped by Ctrl-C or SIGTERM.
"""

from __future__ import annotations

import argparse
import errno
import json
import logging
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
if str(ROOT) not in sys.path:
    # The scripts run from a checkout also where the package was not installed.
    sys.path.insert(0, str(ROOT))

from tqdm import tqdm  # noqa: E402  (after the path is set)

from toolkit.errors import InputError  # noqa: E402
from toolkit.progress import Progress  # noqa: E402

__all__ = ["Bars", "Main", "chosen", "parser_for", "print_stages", "run"]

Main = Callable[[argparse.Namespace, Progress], dict[str, Any]]


def parser_for(description: str | None, *, shot: bool = True) -> argparse.ArgumentParser:
    """An argument parser with the common options; with ``shot`` also the shot folder DIR."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    if shot:
        parser.add_argument("shot", metavar="DIR", type=Path, help="the shot folder")
    parser.add_argument("-v", "--verbose", action="store_true", help="say more, and show where an error came from")
    parser.add_argument("--json", action="store_true", help="end with one line of JSON on standard output")
    return parser


def chosen(options: argparse.Namespace, *names: str) -> dict[str, Any]:
    """Some of the options by name, for a function whose arguments are called the same."""
    return {name: getattr(options, name) for name in names}


class Bars:
    """Progress as a bar on a terminal, as plain lines in a log."""

    def __init__(self, stream: Any = None) -> None:
        self._stream = stream or sys.stderr
        self._interactive = bool(self._stream.isatty())
        self._bar: tqdm[Any] | None = None
        self._what = ""
        self._said = 0.0

    def __call__(self, what: str, done: int, total: int) -> None:
        if self._interactive:
            self._draw(what, done, total)
        elif what != self._what or done >= total or time.monotonic() - self._said > 10:
            if what != self._what or time.monotonic() - self._said > 0.5:
                print(f"  {what}: {done}/{total}", file=self._stream, flush=True)
            self._said = time.monotonic()
        self._what = what

    def _draw(self, what: str, done: int, total: int) -> None:
        if self._bar is None or what != self._what:
            self.close()
            self._bar = tqdm(total=total, desc=f"  {what}", file=self._stream, dynamic_ncols=True, leave=True)
        self._bar.total = total
        self._bar.update(done - self._bar.n)

    def close(self) -> None:
        """Finish the bar that is shown."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def run(parser: argparse.ArgumentParser, main: Main, arguments: list[str] | None = None) -> int:
    """Parse, call ``main(options, progress)``, and turn what happens into an exit code.

    A result whose ``failed`` is not zero ends with 1: the work went on after a failure.
    """
    options = parser.parse_args(arguments)
    level = logging.INFO if options.verbose else logging.WARNING
    logging.basicConfig(level=level, format="%(levelname)s %(message)s", stream=sys.stderr)
    bars = Bars()
    if threading.current_thread() is threading.main_thread():
        # Ended from outside, temporary folders are removed as after Ctrl-C.
        signal.signal(signal.SIGTERM, _stop)
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:  # as nohup and the like want it
            signal.signal(signal.SIGINT, _stop)
    try:
        result = main(options, bars)
        bars.close()
    except InputError as error:
        bars.close()
        return _fail(error, options, 2)
    except KeyboardInterrupt:
        bars.close()
        print("stopped; what was finished is kept", file=sys.stderr)
        return 130
    except OSError as error:
        bars.close()
        return _fail(_of_the_system(error), options, 2 if isinstance(error, _BAD_PLACES) else 1)
    except Exception as error:
        bars.close()
        return _fail(error, options, 1)
    if options.json:
        print(json.dumps(result, default=_plain))
    return 1 if result.get("failed") else 0


def _stop(number: int, _frame: Any) -> None:
    """End by KeyboardInterrupt, but while this thread compiles, soon after.

    Raised where LLVM calls Python back it would be lost, or end the process on the spot.
    """
    lock = getattr(sys.modules.get("numba.core.compiler_lock"), "global_compiler_lock", None)
    if lock is None or not lock.is_locked():
        raise KeyboardInterrupt
    again = threading.Timer(_SOON, _signal_again, (number,))
    again.daemon = True
    again.start()


def _signal_again(number: int) -> None:
    """Signal the main thread: a call that it waits in ends by a signal of its own only."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, number)
    else:
        signal.raise_signal(number)


_SOON = 0.05
"""Seconds until a stop that came while code was compiled comes again."""
_BAD_PLACES = (FileNotFoundError, NotADirectoryError, IsADirectoryError, PermissionError, FileExistsError)
"""Of the system's errors those that another path or its permissions mend; a full disk is none of them."""


def _of_the_system(error: OSError) -> InputError:
    """What the system says, as a sentence."""
    said = (error.strerror or str(error) or type(error).__name__).lower()
    remedy = ""
    if isinstance(error, _BAD_PLACES):
        remedy = "check that the folder is there and that you may write to it"
    elif error.errno in (errno.ENOSPC, errno.EDQUOT):
        remedy = "make some room and run it again; what was finished is kept"
    return InputError(said, where=error.filename or "", remedy=remedy)


def print_stages(reports: list[Any]) -> None:
    """One line a stage, with the numbers that a user wants to see."""
    for report in reports:
        state = "up to date" if report.skipped else f"{report.seconds:.1f} s"
        print(f"{report.stage:<10} {state}")


def _fail(error: Exception, options: argparse.Namespace, code: int) -> int:
    if options.verbose:
        traceback.print_exception(error)
    message = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
    print(f"error: {message}", file=sys.stderr)
    if options.json:
        print(json.dumps({"error": message}))
    return code


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)
