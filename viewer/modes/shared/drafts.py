"""Edits that are not committed yet, kept in the shot folder after every gesture: a kill loses at most the last one."""

from __future__ import annotations

import json
import logging
from typing import Any

from toolkit.meshio.aside import written_aside
from toolkit.shot import Shot

__all__ = ["DraftFile"]

log = logging.getLogger(__name__)


class DraftFile:
    """``drafts.json`` of a shot: the open edit of each kind, as plain JSON values. Not part of the journal."""

    def __init__(self, shot: Shot) -> None:
        self.path = shot.drafts_path

    def read(self, kind: str) -> dict[str, Any] | None:
        """The open edit of a kind; None if there is none, or if the file cannot be read."""
        found = self._all().get(kind)
        return found if isinstance(found, dict) else None

    def write(self, kind: str, data: dict[str, Any] | None) -> None:
        """Keep an open edit, or forget it; on disk when this returns."""
        known = self._all()
        if known.get(kind) == data:
            return
        if data is None:
            known.pop(kind, None)
        else:
            known[kind] = data
        if not known:
            self.path.unlink(missing_ok=True)
            return
        with written_aside(self.path) as temporary:
            temporary.write_text(json.dumps(known), encoding="utf-8")

    def _all(self) -> dict[str, Any]:
        try:
            known = json.loads(self.path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        except (OSError, ValueError) as error:
            log.warning("%s cannot be read and is begun anew: %s", self.path, error)
            return {}
        return known if isinstance(known, dict) else {}
