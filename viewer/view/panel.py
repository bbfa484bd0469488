"""The panel: rows of plain values as widgets, changed in place as long as the rows stay of the same kinds."""

from __future__ import annotations

import textwrap
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from viewer.state import rows as kinds
from viewer.state.events import PanelInput
from viewer.state.rows import Row
from viewer.view.open3d_calls import gui, lowered

__all__ = ["Panel"]

_TONES = {
    "plain": (0.90, 0.91, 0.93),
    "quiet": (0.62, 0.65, 0.69),
    "good": (0.45, 0.85, 0.52),
    "bad": (1.0, 0.55, 0.42),
}
_HEADING = (1.0, 0.80, 0.40)
_SETTLED = 0.25  # seconds without a change after which a slider's value is final


class Panel:
    """Shows rows and sends what is done to them.

    ``widget`` is placed by the window; ``width`` in em.
    """

    def __init__(self, window: Any, send: Callable[[PanelInput], None], width: float) -> None:
        self._em = window.theme.font_size
        self._send, self._letters = send, int(width * 1.92)
        self.widget = gui.ScrollableVert(0, gui.Margins(0.6 * self._em, 0.5 * self._em, 1.0 * self._em, 0.5 * self._em))
        # Translucent: sliders and choices take the panel's colour, and would be nowhere to be seen in an opaque one.
        self.widget.background_color = gui.Color(0.0, 0.0, 0.0, 0.22)
        self._proxy = gui.WidgetProxy()
        self.widget.add_child(self._proxy)
        self._shape: tuple[Any, ...] = ()
        self._updates: list[Callable[[Any], None]] = []
        self._grid: Any = None
        self.named: dict[str, Any] = {}
        self._quiet = False
        self._moving: dict[str, tuple[float, float]] = {}

    def show(self, rows: Sequence[Row]) -> bool:
        """Show ``rows``; True if widgets were made anew, so that the window has to be laid out again."""
        shape = tuple(_shape(row) for row in rows)
        anew = shape != self._shape
        self._quiet = True  # setting a widget's value also calls back
        if anew:
            self._build(rows)
            self._shape = shape
        for update, row in zip(self._updates, rows, strict=True):
            update(row)
        self._quiet = False
        return anew

    def tick(self) -> None:
        """Say that sliders have come to rest."""
        now = time.monotonic()
        for name, (value, when) in list(self._moving.items()):
            if now - when > _SETTLED:
                del self._moving[name]
                self._send(PanelInput(name, value, True))

    def _build(self, rows: Sequence[Row]) -> None:
        column = gui.Vert(0.28 * self._em)
        self._grid = None
        self.named.clear()
        self._updates = [self._make(row, column) for row in rows]
        self._proxy.set_widget(column)

    def _make(self, row: Row, column: Any) -> Callable[[Any], None]:
        if not isinstance(row, _WITH_LABEL):
            self._grid = None
        return _MAKERS[type(row)](self, row, column)

    def _sent(self, name: str, value: Any = None, final: bool = True) -> None:
        if self._quiet:
            return
        if final:
            self._send(PanelInput(name, value))
        else:
            self._moving[name] = (float(value), time.monotonic())
            self._send(PanelInput(name, value, False))

    # -- one method a kind of row: makes the widget, returns what sets its values ----------------------------------

    def _heading(self, row: kinds.Heading, column: Any) -> Callable[[Any], None]:
        column.add_fixed(0.35 * self._em)
        label = gui.Label(row.text)
        label.text_color = gui.Color(*_HEADING)
        column.add_child(label)
        return lambda new: None

    def _note(self, row: kinds.Note, column: Any) -> Callable[[Any], None]:
        label = gui.Label(self._wrapped(row.text))
        column.add_child(label)

        def update(new: kinds.Note) -> None:
            label.text = self._wrapped(new.text)
            label.text_color = gui.Color(*_TONES[new.tone])

        return update

    def _button(self, row: kinds.Button, column: Any) -> Callable[[Any], None]:
        widget, update = self._one_button(row)
        column.add_child(widget)
        return update

    def _buttons(self, row: kinds.Buttons, column: Any) -> Callable[[Any], None]:
        line = gui.Horiz(0.25 * self._em)
        updates = []
        for button in row.buttons:
            widget, update = self._one_button(button)
            line.add_child(widget)
            updates.append(update)
        column.add_child(line)

        def update_all(new: kinds.Buttons) -> None:
            for each, button in zip(updates, new.buttons, strict=True):
                each(button)

        return update_all

    def _one_button(self, row: kinds.Button) -> tuple[Any, Callable[[Any], None]]:
        widget = gui.Button(row.text)
        widget.horizontal_padding_em, widget.vertical_padding_em = 0.45, 0.12
        widget.toggleable = row.on is not None
        name = row.name
        widget.set_on_clicked(lambda: self._sent(name))
        self.named[name] = widget

        def update(new: kinds.Button) -> None:
            widget.text = new.text
            widget.enabled = new.enabled
            if new.on is not None:
                widget.is_on = new.on

        return widget, update

    def _check(self, row: kinds.Check, column: Any) -> Callable[[Any], None]:
        widget = gui.Checkbox(row.text)
        widget.set_on_checked(lambda on: self._sent(row.name, bool(on)))
        column.add_child(widget)
        self.named[row.name] = widget

        def update(new: kinds.Check) -> None:
            widget.checked = new.on

        return update

    def _choice(self, row: kinds.Choice, column: Any) -> Callable[[Any], None]:
        widget = gui.Combobox()
        names = [name for name, _ in row.options]
        for _, words in row.options:
            widget.add_item(words)
        widget.set_on_selection_changed(lambda text, index: self._sent(row.name, names[index]))
        self._line(column, row.text, widget)
        self.named[row.name] = widget

        def update(new: kinds.Choice) -> None:
            if new.chosen in names:
                widget.selected_index = names.index(new.chosen)

        return update

    def _slider(self, row: kinds.Slider, column: Any) -> Callable[[Any], None]:
        widget = gui.Slider(gui.Slider.INT if row.whole else gui.Slider.DOUBLE)
        # Also while it is moved: without a value it would be at its low end, and say so.
        widget.set_limits(_single(row.low), _single(row.high))
        widget.double_value = _held(row)
        widget.set_on_value_changed(lambda value: self._sent(row.name, float(value), False))
        self._line(column, row.text, widget)
        self.named[row.name] = widget

        def update(new: kinds.Slider) -> None:
            if new.name not in self._moving:  # never against the user's hand
                widget.set_limits(_single(new.low), _single(new.high))
                widget.double_value = _held(new)

        return update

    def _number(self, row: kinds.Number, column: Any) -> Callable[[Any], None]:
        widget = gui.NumberEdit(gui.NumberEdit.INT if row.whole else gui.NumberEdit.DOUBLE)
        widget.set_limits(row.low, row.high)
        if not row.whole:
            widget.decimal_precision = 5
        widget.set_on_value_changed(lambda value: self._sent(row.name, int(value) if row.whole else float(value)))
        self._line(column, row.text, widget, lower=0.125)
        self.named[row.name] = widget

        def update(new: kinds.Number) -> None:
            widget.set_value(new.value)

        return update

    def _entry(self, row: kinds.Entry, column: Any) -> Callable[[Any], None]:
        widget = gui.TextEdit()
        widget.set_on_value_changed(lambda text: self._sent(row.name, str(text)))
        self._line(column, row.text, widget)
        self.named[row.name] = widget

        def update(new: kinds.Entry) -> None:
            widget.text_value = new.value

        return update

    def _items(self, row: kinds.Items, column: Any) -> Callable[[Any], None]:
        widget = gui.ListView()
        widget.set_max_visible_items(row.rows)
        shown: list[str] | None = None

        def clicked(_: str, twice: bool) -> None:
            if not twice:
                self._sent(row.name, int(widget.selected_index))

        widget.set_on_selection_changed(clicked)
        column.add_child(widget)
        self.named[row.name] = widget

        def update(new: kinds.Items) -> None:
            nonlocal shown
            if shown != list(new.items):
                shown = list(new.items)
                widget.set_items(shown or [new.empty])
            widget.selected_index = new.chosen

        return update

    def _line(self, column: Any, text: str, widget: Any, lower: float = 0.0) -> None:
        """Labelled rows that follow each other share a grid, so that their widgets stand in one column.

        ``lower`` says by how much the widget is less high than others, in em.
        """
        if self._grid is None:
            self._grid = gui.VGrid(2, 0.06 * self._em)
            column.add_child(self._grid)
        # The two columns keep step only if their rows are equally high.
        step = 0.19 * self._em
        self._grid.add_child(lowered(gui.Label(text), step))
        self._grid.add_child(lowered(widget, 0, step + lower * self._em))

    def _wrapped(self, text: str) -> str:
        return "\n".join(textwrap.fill(part, self._letters) for part in text.splitlines()) if text else " "


def _single(value: float) -> float:
    """What a slider's number becomes: it is drawn in single precision."""
    return float(np.float32(value))


def _held(row: kinds.Slider) -> float:
    """A value that the slider can hold: it calls back where drawing changes the value."""
    return float(round(row.value)) if row.whole else _single(row.value)


def _shape(row: Row) -> tuple[Any, ...]:
    """What may not change while a widget lives."""
    kind = type(row).__name__
    if isinstance(row, kinds.Heading):
        return kind, row.text
    if isinstance(row, kinds.Note):
        return kind, len(row.text) // 46  # a note that needs another line pushes the rest down
    if isinstance(row, kinds.Buttons):
        return (kind, *((b.name, b.on is None) for b in row.buttons))
    if isinstance(row, kinds.Choice):
        return kind, row.name, row.options
    if isinstance(row, kinds.Items):
        return kind, row.name, min(len(row.items), row.rows)
    return kind, row.name


_WITH_LABEL = (kinds.Choice, kinds.Slider, kinds.Number, kinds.Entry)

_MAKERS: dict[type, Callable[[Any, Any, Any], Callable[[Any], None]]] = {
    kinds.Heading: Panel._heading,
    kinds.Note: Panel._note,
    kinds.Button: Panel._button,
    kinds.Buttons: Panel._buttons,
    kinds.Check: Panel._check,
    kinds.Choice: Panel._choice,
    kinds.Slider: Panel._slider,
    kinds.Number: Panel._number,
    kinds.Entry: Panel._entry,
    kinds.Items: Panel._items,
}
