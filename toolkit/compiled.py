"""numba's compiler, for installations where compiled code cannot be kept, too."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numba
from numba.core.compiler import Compiler

__all__ = ["ARITHMETIC", "LOOPS", "DisjointArrays", "helper", "njit"]

log = logging.getLogger(__name__)


class DisjointArrays(Compiler):
    """Compiles for arrays that share no memory with each other, which the caller has to see to.

    A loop is vectorised only where nothing that it reads can be what it has just written. Not told so, the compiler
    compares addresses before every loop, and gives up where there are more than a few.
    """

    def define_pipelines(self) -> Any:
        """Numba's own passes."""
        self.state.flags.noalias = True
        return super().define_pipelines()


LOOPS = {
    "cache": True,
    "nogil": True,
    "fastmath": {"contract"},
    "boundscheck": False,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
}
"""Options of loops over arrays; "contract": a product and a sum in one instruction, sums in the order written."""
ARITHMETIC = LOOPS | {"pipeline_class": DisjointArrays}
"""For what calculates. Of what only copies some is slower so: vectorised, it gathers numbers one by one."""


def njit(**options: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """As `numba.njit`; ``cache=True`` is a wish only.

    numba keeps compiled code beside the source or else in the user's cache, and refuses to be imported where it may
    write to neither, as in some containers. There we compile in every process instead.
    """

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        try:
            compiled: Callable[..., Any] = numba.njit(**options)(function)
        except RuntimeError as error:
            if not options.get("cache"):
                raise
            log.warning("compiling anew (%s); set NUMBA_CACHE_DIR to a folder that can be written", error)
            compiled = numba.njit(**{**options, "cache": False})(function)
        return compiled

    return decorate


def helper(**options: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """As `numba.njit`, for what compiled code alone calls: it is kept within that, and Python cannot call it.

    numba renews what it keeps of a module when that module's file changes, not when that of a helper does.
    """
    decorate: Callable[[Callable[..., Any]], Callable[..., Any]] = numba.njit(
        **{**options, "cache": False, "no_cpython_wrapper": True}
    )
    return decorate
