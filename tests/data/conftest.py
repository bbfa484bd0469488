from __future__ import annotations

from pathlib import Path

import pytest

from data.layout import Layout, load_layout
from data.package import Package
from data.samples import SamplePaths, build_samples


@pytest.fixture(scope="session")
def package(wheel: Path) -> Package:
    return Package(wheel)


@pytest.fixture(scope="session")
def layout(package: Package) -> Layout:
    return load_layout(package)


@pytest.fixture(scope="session")
def coarse(package: Package, tmp_path_factory: pytest.TempPathFactory) -> SamplePaths:
    """The coarsest samples, built afresh."""
    return build_samples(tmp_path_factory.mktemp("coarse"), lambda *_: None, ["asian_female", "hound"], 0)
