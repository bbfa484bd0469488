"""The transport buttons and the time line's picture."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from viewer import timeline
from viewer.layout import Rectangle
from viewer.state.app import App
from viewer.state.events import Command, Event, TimelineInput
from viewer.state.playhead import SPEEDS
from viewer.view import open3d_calls as native
from viewer.view.open3d_calls import gui, image_of, image_widget, lowered

__all__ = ["TimeBar"]

_DIGIT = 0.57  # width of one, in em


class TimeBar:
    """``buttons`` and ``picture`` are placed by the window."""

    def __init__(self, window: Any, app: App, send: Callable[[Event], None]) -> None:
        self._app, self._send = app, send
        self._em = em = window.theme.font_size
        self._scale = app.density
        self.buttons = gui.Horiz(0.3 * em, gui.Margins(0.5 * em, 0.15 * em, 0.5 * em, 0.15 * em))
        for text, command in (
            ("|<", Command("step", -(10**9))),
            ("<", Command("step", -1)),
            ("Play", Command("play")),
            (">", Command("step", 1)),
            (">|", Command("step", 10**9)),
        ):
            button = self._button(text, command)
            if text == "Play":
                self._play = button
        self._loop = self._button("Loop", Command("loop"))
        self._loop.toggleable = True
        self._speed = gui.Combobox()
        for speed in SPEEDS:
            self._speed.add_item(f"{speed:g}x")
        self._speed.set_on_selection_changed(lambda text, index: send(Command("speed", SPEEDS[index])))
        self.buttons.add_child(lowered(self._speed, 0.2 * em))
        digits = len(str(app.play.n_frames))
        self._words = self._label(8.0 + 2 * _DIGIT * digits)
        self.buttons.add_stretch()
        self._window_words = self._label(4.4 + 2 * _DIGIT * digits)
        for text, which in (("[", "first"), ("]", "last"), ("All", "all")):
            button = gui.Button(text)
            button.horizontal_padding_em, button.vertical_padding_em = 0.5, 0.1
            button.set_on_clicked(lambda which=which: self._set_window(which))
            self.buttons.add_child(button)
        self.picture = image_widget()
        self.picture.set_on_mouse(self._mouse)
        self._drawer = timeline.Drawer()
        self._size = (0, 0)
        self._grip = ""

    def place(self, buttons: Rectangle, picture: Rectangle) -> None:
        """Put both into their rectangles."""
        self.buttons.frame, self.picture.frame = native.rectangle(buttons), native.rectangle(picture)
        self._size = picture.size

    def draw(self) -> None:
        """Words, buttons and the picture."""
        app = self._app
        play = app.play
        seconds = play.seconds
        self._words.text = f"frame {play.frame} of {play.n_frames}   {int(seconds // 60):02d}:{seconds % 60:05.2f}"
        self._play.text = "Pause" if play.playing else "Play"
        self._loop.is_on = play.loop
        self._speed.selected_index = SPEEDS.index(play.speed)
        window = play.window
        self._window_words.text = f"window {window[0]} - {window[1]}" if window else "window: all"
        if self._size[0]:
            pixels = self._drawer.draw(self._layout(), app.timeline())
            self.picture.update_image(image_of(pixels))

    def _layout(self) -> timeline.Layout:
        return timeline.Layout(self._size[0], self._size[1], self._app.play.n_frames, self._scale)

    def _label(self, width: float) -> Any:
        """Words that change without a new layout, in a place of their own that is wide enough for all of them."""
        label = gui.Label("")
        place = lowered(label, 0.4 * self._em)
        place.preferred_width = round(width * self._em)
        self.buttons.add_child(place)
        return label

    def _button(self, text: str, command: Command) -> Any:
        button = gui.Button(text)
        button.horizontal_padding_em, button.vertical_padding_em = 0.5, 0.1
        button.set_on_clicked(lambda: self._send(command))
        self.buttons.add_child(button)
        return button

    def _set_window(self, which: str) -> None:
        play = self._app.play
        first, last = play.window or (0, play.n_frames - 1)
        if which == "all":
            self._send(Command("window", None))
        elif which == "first":
            self._send(Command("window", [play.frame, max(last, play.frame)]))
        else:
            self._send(Command("window", [min(first, play.frame), play.frame]))

    def _mouse(self, event: Any) -> Any:
        x, y = float(event.x - self.picture.frame.x), float(event.y - self.picture.frame.y)
        kinds = gui.MouseEvent.Type
        layout = self._layout()
        if event.type == kinds.BUTTON_DOWN:
            self._grip, frame = timeline.at(layout, self._app.play.window, x, y)
            self._send(TimelineInput(self._grip, frame, "press"))
        elif event.type == kinds.DRAG and self._grip:
            self._send(TimelineInput(self._grip, layout.frame(x), "drag"))
        elif event.type == kinds.BUTTON_UP and self._grip:
            self._send(TimelineInput(self._grip, layout.frame(x), "release"))
            self._grip = ""
        elif event.type == kinds.WHEEL:
            self._send(Command("step", -1 if event.wheel_dy > 0 else 1))
        return gui.Widget.EventCallbackResult.CONSUMED
