"""A file is another file when what it refers to has changed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from toolkit.meshio.companions import companions
from toolkit.shot.hashing import HashCache


def hash_of(path: Path) -> str:
    return HashCache(path.parent / "hashes.json").of(path)


def test_the_buffers_of_a_gltf(tmp_path: Path) -> None:
    path, buffer = tmp_path / "face.gltf", tmp_path / "face 1.bin"
    buffer.write_bytes(b"1234")
    embedded = {"uri": "data:application/octet-stream;base64,AAAA", "byteLength": 3}
    path.write_text(json.dumps({"buffers": [{"uri": "face%201.bin", "byteLength": 4}, embedded, {"uri": "lost.bin"}]}))
    assert companions(path) == [buffer]
    before = hash_of(path)
    assert hash_of(path) == before
    buffer.write_bytes(b"12345")
    assert hash_of(path) != before


def test_the_layers_of_a_usd(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Sdf, Usd, UsdGeom

    part, path = tmp_path / "points.usda", tmp_path / "take.usda"
    stage = Usd.Stage.CreateNew(str(part))
    stage.SetDefaultPrim(UsdGeom.Mesh.Define(stage, "/face").GetPrim())
    stage.Save()
    whole = Usd.Stage.CreateNew(str(path))
    whole.DefinePrim(Sdf.Path("/face")).GetReferences().AddReference("./points.usda")
    whole.Save()
    assert companions(path) == [part]
    assert companions(part) == []
    before = hash_of(path)
    part.write_text(part.read_text().replace("face", "head"))
    assert hash_of(path) != before


@pytest.mark.parametrize("name", ["face.gltf", "take.usda", "take.npy"])
@pytest.mark.parametrize("content", [b"", b"[1]", b'{"buffers": [3]}', b"\xff\xfe", b"#usda 1.0\n("])
def test_what_cannot_be_read_has_none(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    assert companions(path) == []
    assert hash_of(path) == hash_of(path)
