"""Where in time we are: frame, play, loop, speed, and the window of an edit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

__all__ = ["SPEEDS", "Playhead"]

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0)


@dataclass
class Playhead:
    """``frame`` of ``n_frames`` at ``fps``; ``window`` first and last frame of the edit, None for all.

    Plays by the clock: frames are left out where drawing is slower than the take.
    """

    n_frames: int = 1
    fps: float = 30.0
    frame: int = 0
    playing: bool = False
    loop: bool = True
    speed: float = 1.0
    window: tuple[int, int] | None = None
    _rest: float = 0.0

    def go(self, frame: int) -> None:
        """Jump to a frame, held within the take."""
        self.frame = min(max(int(frame), 0), self.n_frames - 1)
        self._rest = 0.0

    def step(self, count: int) -> None:
        """Step and stop playing."""
        self.playing = False
        self.go(self.frame + count)

    def toggle(self) -> None:
        """Play, from the start if the end was reached; or pause."""
        self.playing = not self.playing and self.n_frames > 1
        if self.playing and not self.loop and self.frame == self.n_frames - 1:
            self.go(0)

    def advance(self, seconds: float, ready: Callable[[int], bool] = lambda frame: True) -> bool:
        """Let time pass; True if the frame changed.

        Frames that are not ``ready`` are not gone to: rather it plays slower.
        """
        if not self.playing:
            return False
        self._rest += seconds * self.fps * self.speed
        whole = int(self._rest)
        self._rest -= whole
        before = self.frame
        self.frame = next((frame for frame in map(self._after, range(whole, 0, -1)) if ready(frame)), before)
        if not self.loop and self.frame == self.n_frames - 1:
            self.playing = False
        return self.frame != before

    def _after(self, count: int) -> int:
        """The frame that many frames on."""
        following = self.frame + count
        return following % self.n_frames if self.loop else min(following, self.n_frames - 1)

    def set_window(self, first: int, last: int) -> None:
        """The edit's window; ends in any order, held within the take."""
        low, high = sorted(min(max(int(f), 0), self.n_frames - 1) for f in (first, last))
        self.window = (low, high)

    @property
    def seconds(self) -> float:
        """Time of the frame."""
        return self.frame / self.fps
