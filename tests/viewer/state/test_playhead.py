from __future__ import annotations

import pytest

from viewer.state.playhead import Playhead


@pytest.mark.parametrize("step", [1 / 240, 1 / 60, 0.11, 0.5])
def test_playing_keeps_time_whatever_the_tick(step: float) -> None:
    play = Playhead(1000, 30.0)
    play.toggle()
    ticks = round(6.0 / step)
    for _ in range(ticks):
        play.advance(step)
    assert play.frame == pytest.approx(30 * ticks * step, abs=1)


def test_loop_and_end() -> None:
    play = Playhead(10, 10.0, frame=8)
    play.toggle()
    play.advance(0.35)
    assert (play.frame, play.playing) == (1, True)
    play.loop = False
    play.advance(5.0)
    assert (play.frame, play.playing) == (9, False)
    play.toggle()
    assert (play.frame, play.playing) == (0, True)


def test_rather_slower_than_to_frames_that_are_not_ready() -> None:
    play, built = Playhead(100, 30.0, frame=10), {11, 12}
    play.toggle()
    assert play.advance(5.5 / 30, built.__contains__)
    assert play.frame == 12
    assert not play.advance(9 / 30, built.__contains__)
    assert play.frame == 12
    built |= set(range(100))
    assert play.advance(1 / 30, built.__contains__)
    assert play.frame == 13


def test_speed_step_and_window() -> None:
    play = Playhead(100, 30.0, speed=0.5)
    play.toggle()
    play.advance(1.0)
    assert play.frame == 15
    play.step(-100)
    assert (play.frame, play.playing) == (0, False)
    play.set_window(70, 20)
    assert play.window == (20, 70)
    play.set_window(-5, 1000)
    assert play.window == (0, 99)
    assert not Playhead(1).playing
