#!/usr/bin/env python3
"""The paper's Figure 4 on a sample face: how far an edit reaches with the bases, the weights, or both free to change.

One corner of the mouth is pulled in one frame. The columns are that frame, and the frame outside the edit's window
whose expression, by its weights, is most like it. With the bases alone the edit reaches the other frame too; with the
weights alone it stays in the window; with both it does some of each. Colours show how far the surface moved.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from data import ensure_samples  # noqa: E402
from toolkit.editing import EditSession  # noqa: E402
from toolkit.pose_edit import EditParameters, PointConstraint  # noqa: E402
from toolkit.rendering import ColorScale, Renderer, Row, add_legend, contact_sheet  # noqa: E402
from toolkit.rendering.overlay import Markers  # noqa: E402
from toolkit.rendering.shots import ShotViews, open_views  # noqa: E402
from toolkit.shot import Shot  # noqa: E402
from toolkit.shot.config import ShotConfig, SourceInput, TargetInput, save_config  # noqa: E402
from toolkit.stages import run_stages  # noqa: E402

_TARGET = "asian_female"
_WINDOW = 20  # frames on either side of the edited one
_ROWS = {"unedited": "", "bases only": "bases", "weights only": "weights", "both": "both"}


def main() -> int:
    """Make the shot, edit it in three ways, write the picture."""
    options = _parser().parse_args()
    with tempfile.TemporaryDirectory() as folder:
        session = EditSession.open(Shot(options.shot) if options.shot else _sample_shot(Path(folder)))
        views = open_views(session.shot)
        picture, numbers = figure(session, views, options.landmark, options.share, options.width)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(picture).save(options.out, quality=88, optimize=True)
    for name, (inside, outside) in numbers.items():
        print(f"{name:<14} moves the edited frame by {inside:.3g}, the similar one by {outside:.3g} (target's unit)")
    print(options.out)
    if options.json:
        print(json.dumps(numbers))
    return 0


def figure(
    session: EditSession, views: ShotViews, landmark: str, share: float, width: int
) -> tuple[np.ndarray, dict[str, tuple[float, float]]]:
    """The sheet, and how far each way moves the two frames at most."""
    vertex = views.landmarks[landmark]
    key, twin = similar_frames(session, vertex)
    window = (max(key - _WINDOW, 0), min(key + _WINDOW, session.n_frames - 1))
    # Up and out, as half a smile.
    across = np.cross(views.target.up, views.target.forward)
    side = np.sign((session.rest[vertex] - session.rest.mean(axis=0)) @ across)
    x, y, z = share * views.face_heights[1] * (0.5 * side * across + np.asarray(views.target.up))
    pull = PointConstraint(key, vertex, offset=(float(x), float(y), float(z)))
    frames = (key, twin)
    before = [session.unedited_frame(t) for t in frames]
    after = {"unedited": before}
    for name, mode in _ROWS.items():
        if mode:
            session.draft_pose([pull], EditParameters(mode=mode, window=window), warm=False)
            after[name] = [session.frame(t) for t in frames]
    moved = {name: [_moved(a, b) for a, b in zip(shapes, before, strict=True)] for name, shapes in after.items()}
    scale = ColorScale.unsigned(np.stack(moved["both"]), "moved by", "target's unit", percentile=100)
    target, motion = views.target, views.motions[1]
    camera, size = target.camera(1.0), (width, width)
    shaded, painted = Renderer(target.triangles, target.material), Renderer(target.triangles)
    rows = []
    for name, shapes in after.items():
        images = []
        for t, shape, field in zip(frames, shapes, moved[name], strict=True):
            still = (shape - motion.translations[t]) @ motion.rotations[t]
            images.append(shaded.render(still, camera, size, overlays=[Markers([vertex])] if t == key else []))
            images.append(painted.render(still, camera, size, colors=scale.colors(field)))
        rows.append(Row(name, images))
    columns = [f"frame {key}, edited", "moved by", f"frame {twin}, not in the window", "moved by"]
    numbers = {name: (float(a.max()), float(b.max())) for name, (a, b) in moved.items() if name != "unedited"}
    return add_legend(contact_sheet(rows, columns), scale), numbers


def similar_frames(session: EditSession, vertex: int) -> tuple[int, int]:
    """Two frames of the most alike weights, farther apart than the window; in the first the vertex is far from rest."""
    weights, t = session.weights, np.arange(session.n_frames)
    moves = session.unedited_state.take.moves_at([vertex])[:, 0]
    moved = np.linalg.norm(weights @ moves, axis=1)
    apart = np.linalg.norm(weights[:, None] - weights, axis=2)
    unlike = apart / np.maximum(np.linalg.norm(weights, axis=1), 1e-9)[:, None]
    unlike[np.abs(t[:, None] - t) <= _WINDOW + 2] = np.inf
    unlike[(t < _WINDOW) | (t >= session.n_frames - _WINDOW) | (moved < 0.3 * moved.max())] = np.inf
    key, twin = np.unravel_index(int(unlike.argmin()), unlike.shape)
    return int(key), int(twin)


def _moved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt(np.sum((a - b) ** 2, axis=1)))


def _sample_shot(folder: Path) -> Shot:
    samples = ensure_samples(targets=(_TARGET,), level=1)
    target, performer = samples.targets[_TARGET], samples.performer
    source = SourceInput(performer.reference, performer.frames, performer.fps)
    save_config(folder / "shot.toml", ShotConfig(source, TargetInput(target.reference)))
    (folder / "landmarks.json").write_bytes(target.landmarks_head.read_bytes())
    (folder / "feature_lines.json").write_bytes(target.feature_lines.read_bytes())
    shot = Shot(folder)
    run_stages(shot)
    return shot


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shot", type=Path, help="a shot of your own instead of the sample")
    parser.add_argument("--landmark", default="mouth_corner_l", help="the landmark to pull (default %(default)s)")
    parser.add_argument("--share", type=float, default=0.045, help="how far, of the face's height (%(default)s)")
    parser.add_argument("--width", type=int, default=230, help="width of a picture in pixels (default %(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "figure4.jpg", help="default docs/figure4.jpg")
    parser.add_argument("--json", action="store_true", help="end with one machine-readable line")
    return parser


if __name__ == "__main__":
    sys.exit(main())
