from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from toolkit.bases import BasisParameters
from toolkit.errors import InputError
from toolkit.shot import load_config, save_config
from toolkit.smoothing import SmoothingParameters

MINIMAL = '[source]\nreference = "s.obj"\nframes = "take"\n[target]\nreference = "sub/t.ply"\n'


def _written(folder: Path, text: str) -> Path:
    path = folder / "shot.toml"
    path.write_text(text)
    return path


def test_paths_are_relative_to_the_shot(tmp_path: Path) -> None:
    config = load_config(_written(tmp_path, MINIMAL))
    assert config.source.reference == tmp_path / "s.obj"
    assert config.target.reference == tmp_path / "sub" / "t.ply"
    assert config.source.fps is None
    assert config.bases == BasisParameters()


def test_parameters_are_read_and_written(tmp_path: Path) -> None:
    path = _written(
        tmp_path, MINIMAL + "[smoothing]\nsteps = 20\nlambda = 0.4\n[bases]\ncount = 7\n[details]\ngain = 1\n"
    )
    config = load_config(path)
    assert config.smoothing == SmoothingParameters(steps=20, lambda_=0.4)
    assert config.bases.count == 7
    assert config.details.gain == 1.0
    assert config.source.extras == ()
    eyes = (tmp_path / "left eye.ply", tmp_path / "right eye.ply")
    changed = replace(config, source=replace(config.source, fps=24.0, extras=eyes))
    save_config(path, changed)
    assert load_config(path) == changed


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[bases]\ntreshold = 1\n", "did you mean 'threshold'"),
        ("[base]\n", "did you mean 'bases'"),
        ('[bases]\ncount = "ten"\n', r"\[bases\] count = 'ten' should be a whole number"),
        ("[bases]\nthreshold = nan\n", r"\[bases\] threshold = nan should be finite"),
        ("[register]\nmax_distance = inf\n", "should be finite"),
        ("[details]\nmethod = 3\n", "should be a word in quotes"),
        ("[bases]\ncount = 0\n", "count = 0"),
        ("[smoothing]\nmu = 0.3\n", r"mu = 0\.3"),
        ('[details]\nmethod = "magic"\n', "method is one of"),
        ("[stabilise]\nenabled = 1\n", "should be true or false"),
        ('extras = "eyes.ply"\n', r"\[target\] extras = 'eyes.ply' should be a list of files"),
        ("extras = [1]\n", r"\[target\] extras = \[1\] should be a list of files"),
        ("bases = 3\n", "not TOML|should be a table"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_config(_written(tmp_path, text + MINIMAL if text.startswith("bases") else MINIMAL + text))


def test_a_byte_order_mark_does_not_matter(tmp_path: Path) -> None:
    path = _written(tmp_path, MINIMAL)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())  # as some editors on Windows begin their files
    assert load_config(path).source.reference == tmp_path / "s.obj"


def test_missing_inputs(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="new_shot"):
        load_config(tmp_path / "shot.toml")
    with pytest.raises(InputError, match=r"\[source\] has no frames"):
        load_config(_written(tmp_path, MINIMAL.replace('frames = "take"\n', "")))
    with pytest.raises(InputError, match="not TOML"):
        load_config(_written(tmp_path, MINIMAL + "x = = 3"))
    (tmp_path / "shot.toml").write_bytes(MINIMAL.encode("utf-16"))
    with pytest.raises(InputError, match="not TOML"):
        load_config(tmp_path / "shot.toml")
