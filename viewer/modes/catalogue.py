"""The modes, in the order of their numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from viewer.modes.base import Mode
from viewer.modes.detail_edit import DetailEditMode
from viewer.modes.export import ExportMode
from viewer.modes.feature_lines import FeatureLineMode
from viewer.modes.history import History
from viewer.modes.landmarks import LandmarkMode
from viewer.modes.look import Look
from viewer.modes.pose_edit import PoseEdit
from viewer.modes.shared.ground import Grounds

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["make_modes"]


def make_modes(app: App) -> list[Mode]:
    """One of each."""
    grounds = Grounds(app)
    return [
        Look(app),
        LandmarkMode(app),
        FeatureLineMode(app),
        PoseEdit(app, grounds),
        DetailEditMode(app, grounds),
        History(app),
        ExportMode(app),
    ]
