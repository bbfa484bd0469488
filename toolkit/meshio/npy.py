"""Writing ``.npy`` files so that a full disk is an error of the system, with its reason.

NumPy writes arrays to files past Python and then only knows how many items it got rid of; a memory map gets no error
at all, the process is killed.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

__all__ = ["write_array", "write_blocks"]


def write_array(path: Path, array: NDArray[Any]) -> None:
    """Write an array, the same bytes as `numpy.save` does for one in C order."""
    write_blocks(path, array.shape, array.dtype, [array])


def write_blocks(path: Path, shape: tuple[int, ...], dtype: DTypeLike, blocks: Iterable[NDArray[Any]]) -> None:
    """Write an array ``shape`` from consecutive blocks of its rows, which together fill it."""
    kind = np.dtype(dtype)
    header = {"descr": np.lib.format.dtype_to_descr(kind), "fortran_order": False, "shape": shape}
    with path.open("wb") as file:
        np.lib.format.write_array_header_1_0(file, header)
        for block in blocks:
            file.write(np.ascontiguousarray(block, dtype=kind).data)
