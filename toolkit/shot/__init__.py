"""The shot folder: the one place that knows what lies where on disk."""

from toolkit.shot.config import ShotConfig, SourceInput, StabiliseParameters, TargetInput, load_config, save_config
from toolkit.shot.folder import Shot, StageFolder

__all__ = [
    "Shot",
    "ShotConfig",
    "SourceInput",
    "StabiliseParameters",
    "StageFolder",
    "TargetInput",
    "load_config",
    "save_config",
]
