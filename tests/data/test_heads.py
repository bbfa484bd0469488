from __future__ import annotations

import numpy as np
import pytest

from data.heads import HEADS, SHAPES, build_head, eyeballs
from data.layout import LEVELS
from data.remeshing import split_quads
from data.rims import to_curve


def _weights(**shapes: float) -> np.ndarray:
    weights = np.zeros(len(SHAPES))
    for name, weight in shapes.items():
        weights[SHAPES.index(name)] = weight
    return weights


def test_the_crop_has_the_known_counts(layout):
    assert len(layout.base_ids) == 4326
    assert layout.quads(0).shape == (4304, 4)
    assert layout.skin.sum() == 3320
    assert layout.subdivision.counts == (4326, 17259, 68949)
    assert len(SHAPES) == len(set(SHAPES)) == 52


@pytest.mark.parametrize("name", HEADS)
def test_blinks_close_and_mouths_are_closed_at_rest(package, layout, name):
    head, subdivide = build_head(package, name), layout.subdivision.matrix
    assert np.isfinite(head.neutral).all()
    assert np.isfinite(head.offsets).all()
    shut = subdivide @ head.shape(_weights(eyeBlinkLeft=1, eyeBlinkRight=1))
    for side in ("left", "right"):
        upper, lower = (shut[layout.arc(f"eyelid_{side}_{rim}", LEVELS)] for rim in ("upper", "lower"))
        assert np.linalg.norm(to_curve(upper, lower), axis=1).max() < 0.03
    rest = subdivide @ head.neutral
    upper, lower = (rest[layout.arc(f"lip_inner_{lip}", LEVELS)] for lip in ("upper", "lower"))
    gap = to_curve(lower, upper)
    assert np.linalg.norm(gap, axis=1).max() < 0.03
    assert (gap[2:-2, 1] > 0).all(), "the lower lip is above the upper one"


def test_a_blink_leaves_the_other_eye_alone(package, layout):
    head = build_head(package, "male_young")
    right = [layout.landmarks[name] for name in layout.landmarks if name.startswith("lid_") and name.endswith("_r")]
    assert np.abs(head.offsets[SHAPES.index("eyeBlinkLeft")][right]).max() == 0


def test_the_brows_move_the_whole_forehead_but_not_the_crown(package, layout):
    lift = build_head(package, "male_young").offsets[SHAPES.index("browInnerUp")][:, 1]
    at = layout.landmarks
    assert lift[at["brow_inner_l"]] > lift[at["forehead_low"]] > lift[at["forehead_mid"]] > 0.02
    assert lift[at["crown"]] == 0


def test_no_shape_moves_the_border_of_the_neck(package, layout):
    head = build_head(package, "orc")
    assert np.abs(head.offsets[:, layout.loops["neck_boundary"]]).max() == 0


def test_the_eyeballs_sit_behind_the_lids(package, layout):
    head = build_head(package, "male_young")
    eyes, triangles = eyeballs(package, head.eyes)
    left = eyes[eyes[:, 0] > 0]
    assert triangles.max() == len(eyes) - 1
    assert np.linalg.norm(left.mean(0)[:2] - head.neutral[layout.loops["eyelid_rim_left"]].mean(0)[:2]) < 0.6


@pytest.mark.parametrize("name", ["male_young", "asian_female", "hound"])
def test_closed_lids_cover_the_eyeballs(package, layout, name):
    import open3d as o3d

    head = build_head(package, name)
    eyes, _ = eyeballs(package, head.eyes)
    closed = head.shape(_weights(eyeBlinkLeft=1, eyeBlinkRight=1))
    shut = (layout.subdivision.matrix @ closed).astype(np.float32)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(shut, split_quads(layout.quads(LEVELS)).astype(np.uint32))
    middle = eyes[:, 2].mean()
    front = eyes[eyes[:, 2] > middle + 0.3 * (eyes[:, 2].max() - middle)]
    rays = np.column_stack([front, np.tile([0.0, 0, 1], (len(front), 1))]).astype(np.float32)
    assert len(front) > 500
    assert np.isfinite(scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()).all()
