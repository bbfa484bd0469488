from __future__ import annotations

import gc
import time
import weakref

import numpy as np
import pytest

from viewer.view import open3d_calls
from viewer.view.open3d_calls import DynamicMesh


class Scene:
    """Takes what a rendering Scene takes, and draws nothing."""

    def add_geometry(self, *_: object) -> None: ...

    def set_geometry_culling(self, *_: object) -> None: ...

    def remove_geometry(self, *_: object) -> None: ...


def test_the_buffers_of_a_removed_mesh_outlive_it_until_the_renderer_must_have_read_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def mesh() -> DynamicMesh:
        return DynamicMesh(Scene(), "face", np.arange(3, dtype=np.int32)[None], 3)

    first = mesh()
    buffers = [weakref.ref(buffer) for buffer in first.next_buffers()]
    first.remove()
    del first
    gc.collect()
    assert all(buffer() is not None for buffer in buffers)
    later = time.monotonic() + 60
    monkeypatch.setattr(open3d_calls.time, "monotonic", lambda: later)
    mesh().remove()
    gc.collect()
    assert all(buffer() is None for buffer in buffers)
