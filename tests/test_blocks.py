from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from toolkit.blocks import scratch


@pytest.mark.parametrize("shape", [(7, 3, 16), (1,), (5, 0), (100_003, 3)])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_scratch_begins_on_a_cache_line(shape: tuple[int, ...], dtype: type) -> None:
    array = scratch("lines", shape, dtype)
    assert array.shape == shape
    assert array.dtype == dtype
    assert array.flags.carray
    assert array.ctypes.data % 64 == 0 or array.size == 0


def test_scratch_is_kept_by_name_shape_and_type() -> None:
    first = scratch("kept", (4, 5))
    assert scratch("kept", (4, 5)) is first
    assert not np.shares_memory(scratch("other", (4, 5)), first)
    assert scratch("kept", (4, 5), np.float64).dtype == np.float64


def test_no_two_threads_have_the_same_scratch() -> None:
    own = scratch("threads", (4, 5))
    with ThreadPoolExecutor(1) as pool:
        theirs = pool.submit(scratch, "threads", (4, 5)).result()
    assert not np.shares_memory(own, theirs)
