from __future__ import annotations

import numpy as np

from toolkit.rendering.fields import coating_fields
from toolkit.stages.decompose import source_decomposer


def test_the_coating_is_by_the_filter_of_the_stages(hand) -> None:
    """A wavelength is a length on the source; the target is 7.3 times as large."""
    app = hand.app
    settings = app.shot.path / "shot.toml"
    settings.write_text(settings.read_text() + "[smoothing]\nwavelength=0.4\n")
    app.reload()
    app.choose_pair("map")
    app.map = "coating"
    app.maps.field("coating")
    hand.wait()
    assert not app.message
    surface, smoothing = app.surface(1), source_decomposer(app.shot).filter
    expected = coating_fields(surface.vertices, surface.triangles, smoothing)[1]
    np.testing.assert_allclose(app.maps.field("coating").values, expected, rtol=1e-5)
