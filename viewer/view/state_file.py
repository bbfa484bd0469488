"""What the window shows, as JSON: where the panes and the panel's widgets are, and what state the application is in.

For tests that use a real pointer, and for reports of problems.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from viewer.view.window import Window

__all__ = ["write_state"]


def write_state(path: Path, window: Window) -> None:
    """Write it aside and rename it, so that a reader never sees half of it."""
    app = window.app
    size = window.window.size
    state = {
        "size": [size.width, size.height],
        "warm": window.warm,
        "busy": app.busy,
        "script": window.playing_script,
        "stalls": {kind: asdict(one) for kind, one in window.stalls.longest.items()},
        "playing": app.play.playing,
        "frame": app.play.frame,
        "window": app.play.window,
        "mode": app.mode.name,
        "pair": app.pair.name,
        "map": app.map,
        "linked": app.linked,
        "views": [asdict(view) for view in app.views],
        "status": app.status_line()[0],
        "message": app.message,
        "editable": app.editing.session is not None,
        "edits": [[edit.number, edit.kind, edit.on] for edit in app.editing.edits],
        "panes": [_rectangle(pane.widget.frame) for pane in window.panes],
        "timeline": _rectangle(window.times.picture.frame),
        "widgets": {name: _rectangle(widget.frame) for name, widget in window.panel.named.items()},
    }
    aside = path.with_suffix(".part")
    aside.write_text(json.dumps(state), encoding="utf-8")
    os.replace(aside, path)


def _rectangle(frame: Any) -> list[int]:
    return [int(frame.x), int(frame.y), int(frame.width), int(frame.height)]
