from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from scripts import bootstrap

ROOT = Path(bootstrap.ROOT)


@pytest.mark.parametrize("version", [(3, 10), (3, 11), (3, 12), (3, 13)])
def test_supported_pythons_pass(version, monkeypatch):
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: pytest.fail(f"looked for {name} in its place"))
    assert bootstrap.check_python(version) is None


@pytest.mark.parametrize("version", [(3, 9), (3, 14), (4, 0)])
def test_other_pythons_are_refused_with_one_that_is_here(version, monkeypatch):
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: name if name == "python3.12" else None)
    with pytest.raises(bootstrap.SetupError, match=r"make setup PYTHON=python3\.12$"):
        bootstrap.check_python(version)


def test_supported_pythons_are_the_ones_the_package_declares():
    text = (ROOT / "pyproject.toml").read_text()
    (oldest, newest) = bootstrap.OLDEST[1], bootstrap.NEWEST[1]
    assert f'requires-python = ">=3.{oldest},<3.{newest + 1}"' in text
    assert f"open3d==0.19.*; python_version < '3.{bootstrap.OPENGL_ONLY[1] + 1}'" in text


def test_the_loader_is_asked_what_is_missing():
    libraries = {"libc.so.6": "libc6", "libnosuchthing.so.3": "libnosuchthing3"}
    assert bootstrap.missing_libraries(libraries) == ["libnosuchthing.so.3"]


def test_vulkan_is_only_wanted_where_open3d_has_no_opengl():
    assert "libvulkan.so.1" not in bootstrap.wanted_libraries((3, 12))
    assert bootstrap.wanted_libraries((3, 13))["libusb-1.0.so.0"] == "libusb-1.0-0"


def test_a_vulkan_driver_is_found_by_its_announcement(tmp_path, monkeypatch):
    monkeypatch.delenv("VK_DRIVER_FILES", raising=False)
    monkeypatch.delenv("VK_ICD_FILENAMES", raising=False)
    assert not bootstrap.has_vulkan_driver((str(tmp_path), str(tmp_path / "none")))
    (tmp_path / "lvp_icd.x86_64.json").write_text("{}")
    assert bootstrap.has_vulkan_driver((str(tmp_path),))


def test_missing_packages_are_named_once_and_sorted(monkeypatch):
    monkeypatch.setattr(bootstrap, "missing_libraries", lambda wanted: ["libusb-1.0.so.0", "libGL.so.1"])
    monkeypatch.setattr(bootstrap, "has_vulkan_driver", lambda: False)
    monkeypatch.setattr(bootstrap, "has_ensurepip", lambda: False)
    monkeypatch.setattr(bootstrap.sys, "platform", "linux")
    packages = ["libgl1", "libusb-1.0-0", "mesa-vulkan-drivers", "python3.13-venv"]
    assert bootstrap.missing_packages((3, 13)) == packages


def test_without_root_there_is_one_line_to_run(monkeypatch):
    monkeypatch.setattr(bootstrap.os, "geteuid", lambda: 1000)
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: name)
    with pytest.raises(bootstrap.SetupError) as caught:
        bootstrap.install_packages(["libgl1", "libegl1"])
    line = "sudo apt-get update && sudo apt-get install -y --no-install-recommends libgl1 libegl1 && make setup"
    assert str(caught.value).endswith(line)


def test_without_apt_the_packages_are_named(monkeypatch):
    monkeypatch.setattr(bootstrap.shutil, "which", lambda name: None)
    with pytest.raises(bootstrap.SetupError, match="what Debian calls libgl1, libegl1"):
        bootstrap.install_packages(["libgl1", "libegl1"])


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("ImportError: libusb-1.0.so.0: cannot open shared object file: No such file", "libusb-1.0.so.0"),
        ("OSError: libX11.so.6: cannot open shared object file: No such file", "libX11.so.6"),
        ("OSError: libc++.so.1: cannot open shared object file: No such file", "libc++.so.1"),
        ("ImportError: cannot import name 'pybind'", None),
    ],
)
def test_the_loaders_complaint_is_understood(text, name):
    assert bootstrap.missing_from_message(text) == name


def test_the_proof_holds_here_and_installs_nothing(monkeypatch):
    installed = []
    monkeypatch.setattr(bootstrap, "install_packages", installed.extend)
    bootstrap.prove(Path(sys.executable))
    assert installed == []


def test_a_failing_proof_says_which_library(monkeypatch, capsys):
    complaint = "libfoo.so.1: cannot open shared object file: No such file or directory"
    monkeypatch.setattr(bootstrap, "PROOF", f"raise ImportError({complaint!r})")
    with pytest.raises(bootstrap.SetupError, match=r"libfoo\.so\.1 is missing"):
        bootstrap.prove(Path(sys.executable))
    assert complaint in capsys.readouterr().err


def test_an_environment_of_this_python_is_kept_and_another_is_made_anew(tmp_path, monkeypatch):
    made = []

    def fake_venv(command, **_):
        made.append(command)
        return subprocess.CompletedProcess(command, 0)

    folder = tmp_path / ".venv"
    (folder / "bin").mkdir(parents=True)
    python = folder / "bin" / "python"
    python.write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
    python.chmod(0o755)
    assert bootstrap.make_environment(folder) == python
    python.unlink()
    monkeypatch.setattr(bootstrap.subprocess, "run", fake_venv)
    bootstrap.make_environment(folder)
    assert made == [[sys.executable, "-m", "venv", "--clear", str(folder)]]


def test_the_set_up_needs_only_the_standard_library():
    script = str(ROOT / "scripts" / "bootstrap.py")
    result = subprocess.run([sys.executable, "-I", "-S", script, "--help"], capture_output=True, check=False)
    assert result.returncode == 0, result.stderr


def test_errors_exit_with_one_and_one_sentence(monkeypatch, capsys):
    def refuse():
        raise bootstrap.SetupError("Python 3.9 is not supported")

    monkeypatch.setattr(bootstrap, "check_python", refuse)
    assert bootstrap.main([]) == 1
    assert capsys.readouterr().err == "setup: Python 3.9 is not supported\n"
