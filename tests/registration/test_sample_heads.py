"""The sample heads at their coarsest level, where the true answer is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from data.samples import SamplePaths, build_samples
from toolkit.feature_lines import load_feature_lines
from toolkit.meshio import read_mesh
from toolkit.registration import load_landmarks, register
from toolkit.registration.interior import behind_loops

NAMES = ("asian_female", "hound")


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory, wheel: Path) -> SamplePaths:
    return build_samples(tmp_path_factory.mktemp("heads"), lambda *_: None, NAMES, 0)


@pytest.mark.parametrize(("name", "limit"), [("asian_female", 0.012), ("hound", 0.018)])
def test_a_head_is_met(samples: SamplePaths, name: str, limit: float) -> None:
    paths = samples.targets[name]
    source, target = read_mesh(samples.performer.reference), read_mesh(paths.reference)
    lines = load_feature_lines(paths.feature_lines)
    result = register(source, target, load_landmarks(paths.landmarks), lines)
    truth = samples.truth(name).shape(np.zeros(52))
    behind = behind_loops(source, [np.array(x.vertices) for x in lines if x.closed and "outer" not in x.name])
    np.testing.assert_array_equal(result.interior, behind)
    marks = load_landmarks(paths.landmarks)
    extent = float(np.linalg.norm(np.ptp(truth[marks.source], axis=0)))
    near = np.linalg.norm(truth[:, None] - truth[marks.source][None], axis=2).min(axis=1) < 0.15 * extent
    error = np.linalg.norm(result.vertices - truth, axis=1) / extent
    assert error[near & ~behind].mean() < limit
    assert result.quality.wrong_sheet_share is not None
    assert result.quality.wrong_sheet_share <= 0.002
    assert result.quality.flipped_share < 0.01
