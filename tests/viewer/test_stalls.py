from __future__ import annotations

import time

import pytest

from viewer.stalls import StallWatch


def test_the_longest_call_of_each_kind_is_kept() -> None:
    watch = StallWatch()
    tick, press = watch.timed("tick", time.sleep), watch.timed("press", lambda: 7)
    tick(0.03)
    assert press() == 7
    tick(0.001)
    assert watch.longest["tick"].wall >= 0.03
    assert 0 <= watch.longest["press"].wall < watch.longest["tick"].wall
    assert all(one.own <= one.wall for one in watch.longest.values())


def test_waiting_counts_and_what_lies_between_is_the_loops() -> None:
    watch = StallWatch()
    tick = watch.timed("tick", lambda: time.sleep(0.02))
    tick()
    time.sleep(0.05)
    tick()
    assert watch.longest["loop"].wall >= 0.05
    assert watch.longest["tick"].own >= 0.015


def test_a_call_that_fails_is_measured_and_fails() -> None:
    watch = StallWatch()

    def fails() -> None:
        raise KeyError("no")

    with pytest.raises(KeyError):
        watch.timed("key", fails)()
    assert "key" in watch.longest
    watch.begin()
    assert not watch.longest
