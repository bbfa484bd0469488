"""Shots rendered and reported from disk: a small take on one topology, so that no registration is needed."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from toolkit.errors import InputError
from toolkit.mesh import TriangleMesh
from toolkit.meshio import write_mesh
from toolkit.rendering.shots import expressive_frames, open_views
from toolkit.shot import Shot, ShotConfig, SourceInput, TargetInput, save_config
from toolkit.stabilisation import HeadMotion
from toolkit.stages import run_stages

ROOT = Path(__file__).resolve().parents[2]
N_FRAMES = 7


@pytest.fixture(scope="module")
def shot(tmp_path_factory) -> Shot:
    """A ball that bulges in frame 4 and dents in frame 6; the target is wider, larger and lies on its side."""
    import trimesh

    folder = tmp_path_factory.mktemp("wide one")
    mesh = trimesh.creation.icosphere(subdivisions=3)
    rest, triangles = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32)
    front = np.exp(-8 * ((rest - [0, 0, 1]) ** 2).sum(axis=1))[:, None]
    amount = np.array([0, 0.02, 0.05, 0.2, 0.5, 0.1, -0.4])[:, None, None]
    np.save(folder / "frames.npy", (rest * (1 + amount * front)).astype(np.float32))
    wide = Rotation.from_euler("x", 90, degrees=True).apply(3 * rest * [1.2, 1, 1])
    write_mesh(folder / "source.ply", TriangleMesh(rest, triangles))
    write_mesh(folder / "target.ply", TriangleMesh(wide, triangles))
    source = SourceInput(Path("source.ply"), Path("frames.npy"), 25.0)
    save_config(folder / "shot.toml", ShotConfig(source, TargetInput(Path("target.ply"))))
    made = Shot(folder)
    run_stages(made)
    return made


def _run(script: str, *arguments: object) -> dict:
    command = [sys.executable, str(ROOT / "scripts" / script), "--json", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_views_look_at_the_same_side_of_both_faces(shot):
    views = open_views(shot)
    assert views.source.n_frames == views.target.n_frames == N_FRAMES
    assert views.fps == 25
    assert views.target.forward == pytest.approx((0, -1, 0), abs=0.01)
    assert views.target.up == pytest.approx((0, 0, 1), abs=0.01)
    assert views.face_heights[1] / views.face_heights[0] == pytest.approx(3.2, abs=0.3)
    assert views.target.frame(0) == pytest.approx(views.target.rest, abs=0.05)


def test_a_steady_view_holds_the_head_still(shot):
    views = open_views(shot)
    turn = Rotation.from_euler("y", 20, degrees=True).as_matrix()
    moved = HeadMotion(np.tile(turn, (N_FRAMES, 1, 1)), np.tile([1.0, 2, 3], (N_FRAMES, 1)))
    still = views.source.frame(4)
    shaken = replace(views.source, frame=lambda t: views.source.frame(t) @ turn.T + [1, 2, 3])
    steady = replace(views, source=shaken, motions=(moved, views.motions[1])).steady()[0]
    assert steady.frame(4) == pytest.approx(still, abs=1e-6)


def test_extras_ride_with_the_head_on_both_faces(shot, tmp_path):
    """An eye at the source's front is at the target's front, turned as the target's head is."""
    config = shot.config
    place = {"source": [0, 0, 0.8], "target": [0, -2.4, 0]}
    for side, at in place.items():
        ball = TriangleMesh(_ball_vertices() * 0.1 + at, open_views(shot).source.triangles)
        write_mesh(tmp_path / f"{side}.ply", ball)
    save_config(
        shot.path / "shot.toml",
        replace(
            config,
            source=replace(config.source, extras=(tmp_path / "source.ply",)),
            target=replace(config.target, extras=(tmp_path / "target.ply",)),
        ),
    )
    try:
        views = open_views(Shot(shot.path))
        for side, view in (("source", views.source), ("target", views.target)):
            assert view.extras is not None
            assert view.extras.frame(4).mean(axis=0) == pytest.approx(place[side], abs=0.02)
            assert len(view.drawn(4)) == len(view.rest) + len(view.extras.rest)
        (tmp_path / "target.ply").unlink()
        with pytest.raises(InputError, match=r"target\.ply"):
            open_views(Shot(shot.path))
    finally:
        save_config(shot.path / "shot.toml", config)


def _ball_vertices() -> np.ndarray:
    import trimesh

    return np.asarray(trimesh.creation.icosphere(subdivisions=3).vertices)


def test_the_extremes_and_the_calm_frame_are_chosen(shot):
    assert expressive_frames(shot, 3) == [0, 4, 6]


def test_render_makes_sheet_maps_and_video(shot):
    av = pytest.importorskip("av")
    options = ["--frames", "0,4,6", "--width", 60, "--height", 80, "--every", 2]
    made = _run(
        "render.py", shot.path, *options, "--video", "--map", "motion", "--map", "coating", "--map", "registration"
    )
    names = [Path(path).name for path in made["files"]]
    assert names == ["contact_sheet.png", "motion.png", "coating.png", "registration.png", "performance.mp4"]
    assert all(Path(path).parent == shot.render_folder for path in made["files"])
    sheet = Image.open(made["files"][0])
    assert sheet.width > 180
    assert sheet.height > 150
    with av.open(made["files"][-1]) as container:
        stream = container.streams.video[0]
        assert sum(1 for _ in container.decode(stream)) == 4
        assert (stream.width, stream.height) == (128, 80)
        assert float(stream.average_rate) == pytest.approx(12.5)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--frames", "0,99"], "frame 99 is not in the take, which has 7 frames"),
        (["--close-up", "mouth", "--frames", "0"], "too few landmarks are named after the mouth"),
        (["--video", "--every", "0", "--frames", "0"], "--every 0 makes no sense"),
    ],
)
def test_what_cannot_be_rendered_is_said(shot, monkeypatch, capsys, arguments, sentence):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    render, cli = importlib.import_module("render"), importlib.import_module("_cli")
    assert cli.run(render.parser(), render.main, [str(shot.path), "--width", "40", *arguments]) == 2
    assert sentence in capsys.readouterr().err


def test_an_unfinished_shot_says_what_to_run(shot, tmp_path):
    unfinished = tmp_path / "new"
    unfinished.mkdir()
    (unfinished / "shot.toml").write_text((shot.path / "shot.toml").read_text())
    with pytest.raises(InputError, match="has not been run"):
        open_views(Shot(unfinished))


def test_the_report_tells_the_whole_story(shot):
    path = Path(_run("report.py", shot.path, "--count", 3)["report"])
    page = path.read_text(encoding="utf-8")
    assert path == shot.report_path
    for text in ("Registration", "Bases", "Transfer", "Wrinkles", "Timings", "result/frames.npy", "target.ply"):
        assert text in page, text
    assert page.count("<img") >= 10
    assert "Parameters" in page
    assert "nan" not in page.split("</style>")[1].replace("data:image", "").split("base64")[0]
