"""The sample faces: obtained, built and described; no third-party mesh is in the repository (see README.md).

``ensure_samples()`` returns the paths of ordinary files: a performer with a performance, and targets with known
answers. ``python -m data.build OUT`` writes the same to a folder.
"""

from data.heads import SHAPES
from data.samples import PerformerPaths, SamplePaths, TargetPaths, ensure_samples
from data.targets import TARGETS, Truth

__all__ = ["SHAPES", "TARGETS", "PerformerPaths", "SamplePaths", "TargetPaths", "Truth", "ensure_samples"]
