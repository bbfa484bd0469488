"""Put a report together: template, styles and pictures in one file that needs nothing else."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
from numpy.typing import NDArray

from toolkit.report.data import ReportData
from toolkit.report.numbers import number_rows

__all__ = ["build"]


def build(data: ReportData) -> str:
    """Return the report as one HTML document; pictures are embedded, nothing is loaded from elsewhere."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("toolkit.report"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters.update(data_uri=_data_uri, rows=number_rows, anchor=_anchor)
    return environment.get_template("report.html").render(report=data)


def _data_uri(image: NDArray[np.uint8]) -> str:
    """Embed a picture (h, w, 3) uint8 as JPEG: a tenth of a PNG, and renders hide what that costs."""
    from PIL import Image as PilImage

    buffer = io.BytesIO()
    PilImage.fromarray(np.ascontiguousarray(image)).save(buffer, "JPEG", quality=90, subsampling=0, optimize=True)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


def _anchor(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
