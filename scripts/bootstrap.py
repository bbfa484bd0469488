"""Make the environment: ``.venv`` at the repository's root, and the system libraries that Open3D needs.

``make setup`` runs this with the system's own Python, before anything of ours is installed, so it uses the standard
library alone. What it does, in order:

1. refuse a Python that is not supported;
2. find the system libraries that are missing (by opening them, in a child process) and install their Debian packages
   if we may, else stop with the one line to run;
3. make ``.venv`` and install the project in it, editable, with what the demo and the tests need;
4. prove it: import Open3D and pymeshlab in a child process, cast one ray, and read what the loader says if it fails.

Exit code 0: ready; 1: something to be done first, and the last line on standard error says what.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OLDEST, NEWEST = (3, 10), (3, 13)
OPENGL_ONLY = (3, 12)
"""Up to this Python the project uses Open3D 0.19 (OpenGL); later ones are served by 0.20 (Vulkan) only."""

LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libGL.so.1": "libgl1",
    "libOpenGL.so.0": "libopengl0",  # pymeshlab's plug-ins
    "libEGL.so.1": "libegl1",
    "libgomp.so.1": "libgomp1",
    "libudev.so.1": "libudev1",
}
"""Shared libraries that the packages from the registry expect from the system, and their Debian packages."""

VULKAN_LIBRARIES = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libidn2.so.0": "libidn2-0",
    "libvulkan.so.1": "libvulkan1",
}
"""What Open3D 0.20 wants besides."""

TEST_TOOLS = {"Xvfb": "xvfb", "xdotool": "xdotool"}
"""Programs that the viewer's end-to-end tests use, and their Debian packages; without them those tests are left out."""

VULKAN_DRIVER = "mesa-vulkan-drivers"
DRIVER_FOLDERS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d")

PROOF = """
import numpy as np, open3d as o3d, pymeshlab
scene = o3d.t.geometry.RaycastingScene()
scene.add_triangles(o3d.core.Tensor(np.eye(3, dtype=np.float32)), o3d.core.Tensor(np.array([[0, 1, 2]], np.uint32)))
ray = o3d.core.Tensor(np.array([[0, 0, 0, 1, 1, 1]], np.float32))
assert np.isfinite(scene.cast_rays(ray)["t_hit"].numpy()).all()
pymeshlab.MeshSet()
"""


class SetupError(Exception):
    """What is in the way, and the line to run."""


def check_python(version: tuple[int, ...] = sys.version_info[:2]) -> None:
    """Refuse a Python that Open3D has no wheel for, with the ones found on this machine."""
    if OLDEST <= version <= NEWEST:
        return
    names = [f"python3.{minor}" for minor in range(NEWEST[1], OLDEST[1] - 1, -1)]
    found = next((name for name in names if shutil.which(name)), None)
    remedy = f"run: make setup PYTHON={found}" if found else "install one and run: make setup PYTHON=python3.12"
    raise SetupError(f"Python {'.'.join(map(str, version))} is not supported, 3.10 to 3.13 are; {remedy}")


def wanted_libraries(version: tuple[int, ...] = sys.version_info[:2]) -> dict[str, str]:
    """Shared library -> Debian package, for the Open3D that this Python gets."""
    return LIBRARIES if version <= OPENGL_ONLY else {**LIBRARIES, **VULKAN_LIBRARIES}


def missing_libraries(libraries: dict[str, str]) -> list[str]:
    """Names of the libraries that the loader cannot open; asked in a child, as a bad driver can abort a process."""
    code = (
        "import ctypes, sys\nfor name in sys.argv[1:]:\n    try: ctypes.CDLL(name)\n    except OSError: print(name)\n"
    )
    result = subprocess.run([sys.executable, "-c", code, *libraries], capture_output=True, text=True, check=False)
    return [name for name in result.stdout.split() if name in libraries]


def has_vulkan_driver(folders: tuple[str, ...] = DRIVER_FOLDERS) -> bool:
    """Whether any Vulkan driver is announced to the loader."""
    named = os.environ.get("VK_DRIVER_FILES") or os.environ.get("VK_ICD_FILENAMES")
    return bool(named) or any(any(Path(folder).glob("*.json")) for folder in folders)


def missing_packages(version: tuple[int, ...] = sys.version_info[:2]) -> list[str]:
    """Debian packages to install before the environment can be made, sorted."""
    if not sys.platform.startswith("linux"):
        return []
    libraries = wanted_libraries(version)
    packages = {libraries[name] for name in missing_libraries(libraries)}
    if version > OPENGL_ONLY and not has_vulkan_driver():
        packages.add(VULKAN_DRIVER)
    if not has_ensurepip():
        packages.add(f"python{version[0]}.{version[1]}-venv")
    return sorted(packages)


def has_ensurepip() -> bool:
    """Whether this Python can make a virtual environment with pip in it: Debian ships that part apart."""
    check = [sys.executable, "-c", "import ensurepip, venv"]
    return subprocess.run(check, capture_output=True, check=False).returncode == 0


def install_packages(packages: list[str]) -> None:
    """Install Debian packages as root, or raise with the one line to run."""
    line = "apt-get install -y --no-install-recommends " + " ".join(packages)
    if not shutil.which("apt-get"):
        raise SetupError(f"the system lacks what Debian calls {', '.join(packages)}; install it and run: make setup")
    if os.geteuid() != 0:
        raise SetupError(f"system packages are missing; run: sudo apt-get update && sudo {line} && make setup")
    say(f"installing system packages: {', '.join(packages)}")
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for command in ("apt-get update -q", line):
        result = subprocess.run(shlex.split(command), env=environment, capture_output=True, text=True, check=False)
        if result.returncode != 0:
            sys.stderr.write(result.stdout[-2000:] + result.stderr[-2000:])
            raise SetupError(f"'{command}' failed with code {result.returncode}; mend that and run: make setup")


def offer_test_tools() -> None:
    """Install what only the viewer's end-to-end tests need, if we may; the set-up does not fail for it."""
    packages = sorted(package for name, package in TEST_TOOLS.items() if shutil.which(name) is None)
    if not packages or not sys.platform.startswith("linux"):
        return
    try:
        if os.geteuid() == 0 and shutil.which("apt-get"):
            install_packages([*packages, "libgl1-mesa-dri"])
            return
    except SetupError as error:
        say(str(error))
    say(f"without {' and '.join(packages)} the viewer's end-to-end tests are left out")


def make_environment(folder: Path) -> Path:
    """Make the virtual environment, anew if it belongs to another Python; return its interpreter."""
    python = folder / "bin" / "python"
    wanted = f"{sys.version_info[0]}.{sys.version_info[1]}"
    if not _runs(python, f"import sys, pip; assert '%d.%d' % sys.version_info[:2] == '{wanted}'"):
        say(f"making {folder.name} with Python {wanted}")
        subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
    return python


def install_project(python: Path, extras: str) -> None:
    """Install the project, editable, with its extras."""
    say(f"installing Mien and what it needs ({extras}); the first time this fetches about 700 MB")
    command = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-e", f".[{extras}]"]
    if subprocess.run(command, cwd=ROOT, check=False).returncode != 0:
        raise SetupError("pip could not install the project (its words are above); mend that and run: make setup")


def prove(python: Path) -> None:
    """Use Open3D and pymeshlab once, in a child; install a library that only now turns out to be missing."""
    for _attempt in range(5):
        result = subprocess.run([str(python), "-c", PROOF], capture_output=True, text=True, check=False)
        if result.returncode == 0:
            return
        name = missing_from_message(result.stderr)
        package = {**LIBRARIES, **VULKAN_LIBRARIES}.get(name or "")
        if package is None:
            break
        install_packages([package])
    sys.stderr.write(result.stderr[-2000:])
    if name:
        raise SetupError(f"the shared library {name} is missing; install the package that has it and run: make setup")
    raise SetupError(f"Open3D or pymeshlab failed with code {result.returncode} when used; its words are above")


def missing_from_message(text: str) -> str | None:
    """Name of the shared library in the loader's complaint, if it is one."""
    found = re.search(r"(lib[\w.+-]+\.so[\w.]*): cannot open shared object file", text)
    return found.group(1) if found else None


def say(text: str) -> None:
    """Tell the user what is being done."""
    print(f"setup: {text}", flush=True)


def _runs(python: Path, code: str) -> bool:
    if not python.exists():
        return False
    return subprocess.run([str(python), "-c", code], capture_output=True, check=False).returncode == 0


def main(arguments: list[str] | None = None) -> int:
    """Run the set-up; see the module's docstring."""
    parser = argparse.ArgumentParser(description="Make .venv and install the system libraries that Open3D needs.")
    parser.add_argument("--venv", type=Path, default=ROOT / ".venv", help="where the environment goes")
    parser.add_argument("--extras", default="test,usd,alembic", help="extras of pyproject.toml (default %(default)s)")
    parser.add_argument("--check", action="store_true", help="only say which system packages are missing")
    options = parser.parse_args(arguments)
    try:
        check_python()
        packages = missing_packages()
        if options.check:
            print(" ".join(packages))
            return 1 if packages else 0
        if packages:
            install_packages(packages)
        offer_test_tools()
        python = make_environment(options.venv)
        install_project(python, options.extras)
        prove(python)
    except SetupError as error:
        print(f"setup: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    say(f"ready: {options.venv}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
