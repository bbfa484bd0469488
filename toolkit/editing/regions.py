"""Regions that a shot keeps by name, in ``regions.json`` beside its journal."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from toolkit.detail_edit import Region, regions_from_data, regions_to_data
from toolkit.errors import InputError
from toolkit.meshio.aside import written_aside
from toolkit.shot import Shot

__all__ = ["load_regions", "read_regions", "save_regions"]


def load_regions(shot: Shot) -> dict[str, Region]:
    """The regions by name; none where there is no file."""
    return read_regions(shot.regions_path) if shot.regions_path.exists() else {}


def read_regions(path: Path) -> dict[str, Region]:
    """Regions of any file of the same form: ``{"regions": {name: {"vertices": [...], "weights": [...]}}}``."""
    return regions_from_data(_json(path), where=path)


def save_regions(shot: Shot, regions: dict[str, Region]) -> None:
    """Write all regions, in place of those that were there."""
    with written_aside(shot.regions_path) as temporary:
        temporary.write_text(json.dumps(regions_to_data(regions)) + "\n", encoding="utf-8")


def _json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError("the file cannot be read", where=path, remedy="check the path") from error
    except ValueError as error:
        raise InputError(f"this is not JSON ({error})", where=path, remedy="mend that line") from error
