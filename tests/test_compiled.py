from __future__ import annotations

import logging

import numba
import pytest

from toolkit.compiled import njit


def test_nowhere_to_keep_compiled_code(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    """As in a container with read-only files and no home."""

    def refuse(self: object, impl: object) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr(numba.core.caching.FunctionCache, "__init__", refuse)
    with caplog.at_level(logging.WARNING):
        twice = njit(cache=True, nogil=True)(lambda x: 2 * x)
    assert twice(21) == 42
    assert "NUMBA_CACHE_DIR" in caplog.text


def test_other_errors_are_not_swallowed(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(**options: object) -> None:
        raise RuntimeError("something else")

    monkeypatch.setattr(numba, "njit", fail)
    with pytest.raises(RuntimeError, match="something else"):
        njit(nogil=True)(lambda x: x)
