from __future__ import annotations

import numpy as np
import pytest

from data.heads import SHAPES
from data.performance import event_peaks, expression_weights, head_motion
from data.performer import load_performer


@pytest.fixture(scope="module")
def weights() -> np.ndarray:
    return expression_weights()


def test_the_script_starts_and_ends_neutral_and_stays_in_range(weights):
    assert weights.shape[0] >= 150
    assert weights.shape[1] == 52
    assert not weights[0].any()
    assert not weights[-1].any()
    assert weights.min() >= 0
    assert weights.max() <= 1


def test_the_curves_have_no_jumps_in_speed(weights):
    blinks = [SHAPES.index(name) for name in ("eyeBlinkLeft", "eyeBlinkRight")]
    slow = np.delete(weights, blinks, axis=1)
    assert np.abs(np.diff(slow, axis=0)).max() < 0.25
    assert np.abs(np.diff(slow, 2, axis=0)).max() < 0.12


def test_it_has_the_promised_expressions(weights):
    peaks = event_peaks()
    expected = {
        "smile": "mouthSmileLeft",
        "frown": "mouthFrownLeft",
        "brow raise": "browInnerUp",
        "mouth open": "jawOpen",
        "wink": "eyeBlinkLeft",
        "eyes closed": "eyeBlinkRight",
    }
    for event, shape in expected.items():
        assert weights[peaks[event], SHAPES.index(shape)] > 0.8
    assert weights[peaks["wink"], SHAPES.index("eyeBlinkRight")] < 0.1


def test_the_head_moves_a_few_degrees_about_its_neck():
    rotations, translations = head_motion(186)
    np.testing.assert_allclose(rotations[0], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(translations[0], 0, atol=1e-12)
    np.testing.assert_allclose(
        rotations @ np.swapaxes(rotations, 1, 2), np.broadcast_to(np.eye(3), (186, 3, 3)), atol=1e-12
    )
    angles = np.degrees(np.arccos(np.clip((np.trace(rotations, axis1=1, axis2=2) - 1) / 2, -1, 1)))
    assert 2 < angles.max() < 10
    assert np.diff(angles).max() < 0.6


def test_wrinkles_come_with_compression_and_go_without(package, weights):
    performer = load_performer(package, 2)
    peaks = event_peaks()

    def energy(frame: int, family: str) -> float:
        smooth = performer.smooth(weights[frame])
        heights = [one.height(smooth) for one in performer.families if one.name == family]
        return float(np.sqrt(np.mean(np.concatenate(heights) ** 2)))

    strongest = {"smile": "crow", "frown": "glabella", "brow raise": "forehead", "sneer": "bunny"}
    for event, family in strongest.items():
        assert energy(0, family) == 0
        assert energy(peaks[event], family) > 0.005, (event, family)
    assert energy(peaks["smile"], "smile_fold") > 0.01
    assert energy(peaks["smile"], "forehead") < 0.1 * energy(peaks["brow raise"], "forehead")
    wink = performer.smooth(weights[peaks["wink"]])
    left, right = (np.abs(one.height(wink)).max() for one in performer.families if one.name == "crow")
    assert left > 0.02
    assert right < 0.002


def test_relief_is_as_deep_as_skin(package, weights):
    performer = load_performer(package, 2)
    peak = weights[event_peaks()["brow raise"]]
    moved = np.linalg.norm(performer.frame(peak) - performer.smooth(peak), axis=1)
    assert 0.02 < moved.max() < 0.12
    pores = np.abs(performer.relief[performer.relief != 0])
    assert 0.001 < np.sqrt(np.mean(pores**2)) < 0.02
