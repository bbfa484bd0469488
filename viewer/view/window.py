"""The window: two panes, the panel, the time line, the status line; what changed is drawn once a tick."""

from __future__ import annotations

import logging
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from viewer.help_card import draw_help
from viewer.layout import PANEL, Rectangle, arrange
from viewer.legend import draw_legend
from viewer.script import Player, Recorder
from viewer.stalls import StallWatch
from viewer.state.app import App
from viewer.state.events import Command, Event, Key
from viewer.state.look import help_groups
from viewer.view import open3d_calls as native
from viewer.view.open3d_calls import gui, image_of, image_widget
from viewer.view.pane import Pane
from viewer.view.panel import Panel
from viewer.view.state_file import write_state
from viewer.view.time_bar import TimeBar

__all__ = ["Window"]

log = logging.getLogger(__name__)

# Seconds after a change when it is drawn again: a busy renderer leaves frames out, and the last one would be seen
# only at the next event.
_AGAIN = (0.05, 0.15, 0.4, 1.0, 2.0)
_SIZE, _PLAIN_EM = (1500, 920), 16  # of the window and its type, on a plain screen
_WARM = 20  # ticks in which compiled code is loaded and the first pictures are made
_TITLE = (0.80, 0.82, 0.86)
_TONES = {"plain": (0.86, 0.88, 0.91), "good": (0.45, 0.85, 0.52), "bad": (1.0, 0.55, 0.42)}


class Window:
    """Shows an `App` until it asks to quit."""

    def __init__(
        self,
        app: App,
        size: tuple[int, int] | None = None,
        player: Player | None = None,
        recorder: Recorder | None = None,
        state_file: Path | None = None,
    ) -> None:
        self.app, self._player, self._recorder, self._state_file = app, player, recorder, state_file
        self.application = gui.Application.instance
        self.application.initialize()
        title = f"Mien: {app.shot.path.resolve().name}"
        self.window = self.application.create_window(title, *(size or _SIZE))
        self._em = self.window.theme.font_size
        app.density = self._em / _PLAIN_EM
        if size is None:  # the type is known only now
            size = (round(_SIZE[0] * app.density), round(_SIZE[1] * app.density))
            self.window.size = gui.Size(*size)
        self.stalls = StallWatch()
        self._timed_step = self.stalls.timed("tick", self._step)
        self.panes = [Pane(self.window, app, index, self.send) for index in (0, 1)]
        self.panel = Panel(self.window, self.stalls.timed("panel", self.send), PANEL)
        self.times = TimeBar(self.window, app, self.stalls.timed("time line", self.send))
        self._titles = [gui.Label("") for _ in self.panes]
        # What no widget covers is never wiped.
        self._floor, self._back = _ground(0.175), _ground(0.285)
        self._status = gui.Label("")
        self._status.background_color = gui.Color(0.175, 0.175, 0.18)
        self._progress = gui.ProgressBar()
        self._cancel = gui.Button("Cancel")
        self._cancel.horizontal_padding_em, self._cancel.vertical_padding_em = 0.45, 0.0
        self._cancel.set_on_clicked(lambda: self.send(Command("cancel")))
        self._legend = image_widget()
        self._legend_of: Any = None
        self._places = arrange(Rectangle(0, 0, *size), self._em)
        self._help = image_widget()
        self._help_of: Any = None
        self._build()
        self._held: set[str] = set()
        self._last = time.monotonic()
        self._settle = 3
        self._again: list[float] = []
        self._quitting = self._asked_to_close = False
        self._stale, self._was_busy = True, False
        self._ticks = 0

    def run(self) -> None:
        """Until the window is closed."""
        self.application.run()

    def send(self, event: Event) -> None:
        """One event, of the user or of a script."""
        if self._recorder is not None:
            self._recorder.write(event)
        try:
            self.app.handle(event)
        except Exception as error:
            log.exception("%s", event)
            self.app.say(f"that went wrong: {type(error).__name__}: {error}", "bad")

    def screenshot(self, path: Path) -> None:
        """Save both panes as a picture, once the renderer has made them."""
        found: dict[int, Any] = {}

        def got(index: int, pixels: Any) -> None:
            found[index] = pixels
            if len(found) == len(self.panes):
                height = min(len(pixels) for pixels in found.values())
                both = np.concatenate([found[index][:height, :, :3] for index in range(len(found))], axis=1)
                Image.fromarray(np.ascontiguousarray(both)).save(path)

        for index, pane in enumerate(self.panes):
            native.save_scene(pane.scene, partial(got, index))

    @property
    def warm(self) -> bool:
        """Whether the first pictures are made: before that, clicks may be lost."""
        return self._ticks > _WARM

    @property
    def playing_script(self) -> bool:
        """Whether a script has lines left."""
        return self._player is not None and not self._player.finished

    # -- building -------------------------------------------------------------------------------------------------

    def _build(self) -> None:
        for pane in self.panes:
            pane.widget.set_on_mouse(self.stalls.timed("pointer", pane.mouse))
            self.window.add_child(pane.widget)
        for widget in (self._help, self._legend, self._progress, self._cancel):
            widget.visible = False
        for label in self._titles:
            label.text_color = gui.Color(*_TITLE)
            label.background_color = gui.Color(0.0, 0.0, 0.0, 0.0)
        for widget in (
            self._back, self.panel.widget, self.times.buttons, self.times.picture, *self._titles,
            self._floor, self._status, self._progress, self._cancel, self._legend, self._help,
        ):  # fmt: skip
            self.window.add_child(widget)
        self.window.set_on_layout(self.stalls.timed("layout", self._layout))
        self.window.set_on_tick_event(self._tick)
        self.window.set_on_key(self.stalls.timed("key", self._key))
        self.window.set_on_close(self._closing)

    def _layout(self, context: Any) -> None:
        whole = self.window.content_rect
        self._places = places = arrange(Rectangle(whole.x, whole.y, whole.width, whole.height), self._em)
        for pane, label, frame, title in zip(self.panes, self._titles, places.panes, places.titles, strict=True):
            pane.place(frame)
            label.frame = native.rectangle(title)
        self.times.place(places.buttons, places.times)
        for widget, place in (
            (self._back, places.panel), (self.panel.widget, places.panel), (self._floor, places.floor),
            (self._status, places.status), (self._progress, places.progress), (self._cancel, places.cancel),
            (self._legend, places.legend),
        ):  # fmt: skip
            widget.frame = native.rectangle(place)
        self._settle, self._stale = 3, True
        self.app.touch("camera", "faces", "overlay", "timeline")

    # -- drawing --------------------------------------------------------------------------------------------------

    def _tick(self) -> bool:
        drawn = self._timed_step()
        if self._state_file is not None:
            self._write_state(drawn)
        return drawn

    def _step(self) -> bool:
        """Let time pass, and draw what changed; True if anything did."""
        now = time.monotonic()
        passed, self._last = now - self._last, now
        if self._player is not None:
            self._player.play(self.send, self.app, self)
        self._ticks += 1
        if self._ticks == _WARM:
            self.stalls.begin()
        self.panel.tick()
        self.app.tick(min(passed, 0.5))
        if self._asked_to_close:
            self._asked_to_close = False
            self.send(Command("quit"))
        if self.app.quit_asked and not self._quitting:
            self._quitting = True
            native.quit_later(self.application, self.window)
        changes = self.app.take_changes()
        if self._settle:  # Open3D sets its own projection once after a change of size
            self._settle -= 1
            changes.add("camera")
        if changes:
            self._draw(changes)
            self._again = [now + later for later in _AGAIN]
        again = bool(self._again) and now >= self._again[0]
        if again:
            self._again = [when for when in self._again if when > now]
            for pane in self.panes:
                pane.widget.force_redraw()
        return bool(changes) or again

    def _write_state(self, changed: bool) -> None:
        """After changes, and once more when they have been drawn."""
        busy = self.app.busy
        if changed or self._stale or busy != self._was_busy or self._ticks == _WARM + 1:
            self._stale, self._was_busy = changed, busy
            write_state(self._state_file, self)  # type: ignore[arg-type]

    def _draw(self, changes: set[str]) -> None:
        for pane in self.panes:
            if "camera" in changes:
                pane.draw_camera()
            if "faces" in changes:
                pane.draw_face()
            if "overlay" in changes:
                pane.draw_overlay()
        if "faces" in changes:
            self._draw_titles()
        if "timeline" in changes:
            self.times.draw()
        if "panel" in changes:
            self._draw_panel()
        if changes & {"status", "panel", "timeline"}:
            self._draw_status()
        self._draw_help()

    def _draw_titles(self) -> None:
        for label, words in zip(self._titles, self.app.pair.titles, strict=True):
            label.text = words
        field = self.app.field(1)
        self._legend.visible = field is not None
        if field is not None and self._legend_of != (field.scale, self._places.legend):
            self._legend_of = (field.scale, self._places.legend)
            self._legend.update_image(image_of(draw_legend(field.scale, self._places.legend.width, self.app.density)))

    def _draw_panel(self) -> None:
        anew = self.panel.show(self.app.rows())
        if anew:
            self.window.set_needs_layout()

    def _draw_status(self) -> None:
        words, tone = self.app.status_line()
        self._status.text, self._status.text_color = words, gui.Color(*_TONES[tone])
        progress = self.app.worker.progress
        self._progress.visible = self._cancel.visible = progress is not None
        if progress is not None:
            self._progress.value = progress[1] / progress[2] if progress[2] else 0.0

    def _draw_help(self) -> None:
        """Over both panes, in their middle."""
        self._help.visible = self.app.help_shown
        wanted = (self.app.mode, self._places.help)
        if self.app.help_shown and self._help_of != wanted:
            self._help_of, room = wanted, self._places.help
            card = draw_help(help_groups(self.app), room.size, self.app.density)
            self._help.update_image(image_of(card))
            self._help.frame = native.rectangle(room.middle(card.shape[1], card.shape[0]))

    # -- keys and the end -----------------------------------------------------------------------------------------

    def _key(self, event: Any) -> bool:
        held = native.held_name(event)
        down = event.type == gui.KeyEvent.Type.DOWN
        if held is not None:
            (self._held.add if down else self._held.discard)(held)
            return False
        name = native.key_name(event)
        if name == "escape":
            self._asked_to_close = False
        if not down or name is None:
            return False
        self.send(Key(name, tuple(sorted(self._held))))
        return True

    def _closing(self) -> bool:
        """Asked by the frame's button, and by Open3D before every Escape, as its key event tells after that."""
        self._asked_to_close = True
        return self._quitting


def _ground(shade: float) -> Any:
    """Something to put others on."""
    made = gui.Vert()
    made.background_color = gui.Color(shade, shade, shade + 0.005)
    return made
