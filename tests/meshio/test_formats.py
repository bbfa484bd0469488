import subprocess
import sys

import pytest

from toolkit.errors import InputError
from toolkit.meshio import open_sequence, read_mesh, write_mesh


def test_missing_files_and_unknown_suffixes_are_said(tmp_path):
    with pytest.raises(InputError, match=r"gone\.obj: there is no such file; check the path\."):
        read_mesh(tmp_path / "gone.obj")
    with pytest.raises(InputError, match=r"gone: there is no such file"):
        open_sequence(tmp_path / "gone")
    (tmp_path / "a.fbx").touch()
    with pytest.raises(InputError, match=r"'\.fbx' is not known as a mesh; use one of \.obj \.ply"):
        read_mesh(tmp_path / "a.fbx")
    with pytest.raises(InputError, match=r"'\.fbx' is not known as a take; use one of \.npy"):
        open_sequence(tmp_path / "a.fbx")
    with pytest.raises(InputError, match="is a folder, but one mesh is wanted"):
        read_mesh(tmp_path)


def test_an_unknown_format_to_write_is_said(tmp_path, monkeypatch):
    (tmp_path / "a.stl").touch()
    with pytest.raises(InputError, match=r"'\.stl' is not known as a mesh to write; use one of \.obj \.ply"):
        write_mesh(tmp_path / "a.stl", None)


def test_import_brings_no_heavy_library():
    code = "import sys, toolkit.meshio, toolkit.export; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"open3d", "trimesh", "pxr", "alembic3d", "matplotlib", "pymeshlab"} & set(loaded)
