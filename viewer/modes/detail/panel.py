"""The panel of the detail edit mode: its rows, and what each does to the draft."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from viewer.modes.detail.draft import ACTIONS, DetailDraft
from viewer.state.rows import Button, Buttons, Check, Choice, Entry, Heading, Items, Note, Number, Row, Slider

if TYPE_CHECKING:
    from viewer.modes.detail_edit import DetailEditMode

__all__ = ["KEYS", "detail_rows", "hint", "tool_of", "used"]

KEYS = (
    ("b, c, p, n", "brush, line, place the copy, new line"),
    ("[, ], ctrl-wheel", "brush size"),
    ("h", "hide or show the region and the lines"),
    ("delete", "take the last point of the line away"),
    ("enter, esc", "commit the edit, give it up"),
)
_NUMBERS: dict[str, tuple[float, float]] = {
    "factor": (-10.0, 10.0),
    "rotation": (-180.0, 180.0),
    "scale": (0.05, 10.0),
    "strength": (-10.0, 10.0),
    "stiffness": (1e-4, 1e4),
    "band": (0.0, 50.0),
    "threshold": (0.01, 1.0),
}
_FLAGS = ("mirror", "hold", "add", "everywhere")


def hint(mode: DetailEditMode) -> str:
    """What a click will do now."""
    if mode.tool == "paint":
        return "drag over the wrinkle to paint, shift erases; ctrl-wheel sizes the brush"
    if mode.tool == "place":
        return "drag the copy to its place; the white knob turns and scales it"
    which = "the new line" if mode.tool == "goal" else "a line along the wrinkle"
    return f"drag {which} in one go, or click its points; drag a point to mend it"


def detail_rows(mode: DetailEditMode) -> list[Row]:
    """All rows."""
    if mode.grounds.ground is None:
        return [Note("preparing to paint ...", "quiet")]
    draft = mode.current
    rows: list[Row] = [Choice("action", "do", ACTIONS, draft.action), mode.tool_row(), *mode.commit_rows()]
    if mode.draft is not None and draft.missing:
        rows.append(Note(f"Next: {draft.missing}.", "plain"))
    rows += _region_rows(mode, draft)
    rows += {"scale": _scale_rows, "paste": _paste_rows, "reshape": _reshape_rows, "gain": _gain_rows}[draft.action](
        mode, draft
    )
    rows += _time_rows(mode, draft)
    rows.append(Entry("note", "note", draft.note))
    return rows


def used(mode: DetailEditMode, name: str, value: Any, final: bool) -> None:
    """A row was used."""
    actions = {
        "grow": lambda: mode.resize(1),
        "shrink": lambda: mode.resize(-1),
        "mirror_region": mode.mirror_region,
        "clear": mode.clear_region,
        "save_region": mode.save_region,
        "delete_key": mode.delete_key,
        "add_key": mode.add_key,
        "rekey": mode.use_this_frame,
        "from_here": mode.copy_from_here,
    }
    if name in actions:
        actions[name]()
    elif name == "hardness":
        mode.brush.hardness = float(np.clip(value, 0, 1))
    elif name == "show_region":
        mode.show_region = bool(value)
        mode.app.touch("faces")
    elif name == "region_name":
        mode.region_name = str(value)
    elif name == "load_region":
        mode.load_region(str(value))
    elif name == "action":
        mode.choose_action(str(value))
    elif name in ("width", "soft"):
        mode.change_width(name, float(value) / 100, final)
    elif name == "gain":
        mode.set_gain(float(value), final)
    elif name == "key":
        mode.choose_key(int(value))
    else:
        _change(mode, name, value, final)


def _change(mode: DetailEditMode, name: str, value: Any, final: bool) -> None:
    if name in _NUMBERS:
        mode.put(final, **{name: float(np.clip(float(value), *_NUMBERS[name]))})
    elif name in _FLAGS:
        mode.put(True, **{name: bool(value)})
    elif name == "remove":
        mode.put(True, factor=0.0)
    elif name == "double":
        mode.put(True, factor=2.0)
    elif name in ("details", "propagation"):
        mode.put(True, **{name: str(value)})
    elif name == "found":
        mode.put(True, window=None if value else mode.app.play.window)
    elif name == "source_shot":
        mode.put(True, source_shot=str(value) or None)
    elif name == "note":
        mode.put(True, note=str(value))


def _region_rows(mode: DetailEditMode, draft: DetailDraft) -> list[Row]:
    count = len(draft.region) if draft.region is not None else 0
    words = f"{count:,} vertices" if count else "nothing selected yet"
    rows: list[Row] = [Heading("Region"), Note(words, "quiet")]
    if mode.tool == "paint":
        rows.append(mode.brush_row())
        rows.append(Slider("hardness", "hardness", mode.brush.hardness, 0.0, 1.0))
    elif mode.tool == "line" and draft.curve is not None:
        rows.append(Slider("width", "reach, % of the face", 100 * draft.width, 0.2, 15.0))
        rows.append(Slider("soft", "soft border", 100 * draft.soft, 0.0, 10.0))
    rows.append(
        Buttons(
            (
                Button("grow", "Grow", count > 0),
                Button("shrink", "Shrink", count > 0),
                Button("mirror_region", "Mirror", count > 0),
                Button("clear", "Clear", count > 0),
            )
        )
    )
    names = tuple(mode.saved)
    rows.append(Entry("region_name", "name", mode.region_name))
    rows.append(Button("save_region", "Save the region under this name", count > 0))
    if names:
        rows.append(Choice("load_region", "saved", (("", "choose ..."), *((name, name) for name in names)), ""))
    rows.append(Check("show_region", "show it (h)", mode.show_region))
    return rows


def _scale_rows(mode: DetailEditMode, draft: DetailDraft) -> list[Row]:
    return [
        Heading("Strength"),
        Slider("factor", "times", draft.factor, -1.0, 4.0),
        Buttons((Button("remove", "Remove (0)"), Button("double", "Double (2)"))),
    ]


def _paste_rows(mode: DetailEditMode, draft: DetailDraft) -> list[Row]:
    shown, source = mode.app.play.frame, draft.source_frame
    words = f"copied from frame {source}" if source is not None else "copied from the key frame"
    return [
        Heading("The copy"),
        Slider("rotation", "turned, degrees", draft.rotation, -180.0, 180.0),
        Slider("scale", "size, times", draft.scale, 0.2, 5.0),
        Slider("strength", "depth, times", draft.strength, -1.0, 4.0),
        Check("mirror", "mirrored", draft.mirror),
        Check("add", "on top of what is there", draft.add),
        Check("hold", "hold still instead of going on as in the source", draft.hold),
        Note(words, "quiet"),
        Button("from_here", f"Copy from frame {shown}, which is shown"),
        Entry("source_shot", "other shot", draft.source_shot or ""),
    ]


def _reshape_rows(mode: DetailEditMode, draft: DetailDraft) -> list[Row]:
    return [Heading("The bend"), Slider("stiffness", "stiffness", draft.stiffness, 0.01, 2.0)]


def _gain_rows(mode: DetailEditMode, draft: DetailDraft) -> list[Row]:
    gains = draft.gains
    rows: list[Row] = [Heading("Gain"), Check("everywhere", "the whole face", draft.everywhere)]
    key = mode.key_index
    value = gains[key][1] if 0 <= key < len(gains) else 1.0
    rows.append(Slider("gain", "times", value, -1.0, 4.0))
    if draft.details == "dynamic":
        rows.append(Items("key", tuple(f"frame {frame}: times {gain:.2f}" for frame, gain in gains), key, 4))
        rows.append(
            Buttons(
                (
                    Button("add_key", f"Key at frame {mode.app.play.frame}"),
                    Button("delete_key", "Delete key", len(gains) > 1),
                )
            )
        )
    return rows


def _time_rows(mode: DetailEditMode, draft: DetailDraft) -> list[Row]:
    which = (("dynamic", "the wrinkles of the take"), ("static", "the face's own details"))
    rows: list[Row] = [Heading("When"), Choice("details", "change", which, draft.details)]
    if draft.action != "gain" and draft.details == "dynamic":
        window = draft.window or (mode.change.window if mode.change is not None and not draft.empty else None)
        frame = draft.frame if mode.draft is not None else mode.app.play.frame
        words = f"key frame {frame}"
        if window is not None:
            words += f", acts in frames {window[0]} to {window[1]}"
        rows.append(Note(words, "quiet"))
        if mode.draft is not None and mode.app.play.frame != draft.frame:
            rows.append(Button("rekey", f"Make frame {mode.app.play.frame} the key frame"))
        rows.append(Check("found", "find the window by the wrinkle", draft.window is None))
        if draft.window is None:
            rows.append(Slider("threshold", "until it is down to, share", draft.threshold, 0.05, 0.9))
        else:
            rows.append(Note("drag the window's ends on the time line", "quiet"))
    rows.append(mode.settings_row())
    if mode.settings:
        rows.append(Number("band", "smoothing band, edges", draft.band, 0.0, 50.0))
        if draft.action != "gain":
            ways = (("follow", "as the take goes on"), ("gradients", "the paper's gradients"))
            rows.append(Choice("propagation", "in time", ways, draft.propagation))
    return rows


def tool_of(action: str, draft: DetailDraft) -> str:
    """The tool that an action needs next."""
    if action == "reshape":
        return "goal" if draft.curve is not None else "line"
    if action == "paste":
        return "place" if draft.region is not None and len(draft.region) else "paint"
    return "paint"
