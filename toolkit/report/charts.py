"""Curves as small hand-made SVG that takes its colours from the page, so that it fits light and dark alike."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["heat_chart", "line_chart"]

_WIDTH, _HEIGHT = 640, 240
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 14, 14, 40
_COLORS = ("#4c8dd6", "#e0803a", "#45a566", "#c4558f", "#8d78d8", "#b09a2c", "#4fb0b5", "#d0605e")


def line_chart(
    curves: Mapping[str, ArrayLike],
    *,
    x_label: str = "frame",
    y_label: str = "",
) -> str:
    """Draw curves over a shared axis as an SVG element.

    ``curves`` has values (N,) at 0, 1, 2, ... by name; what is not finite leaves a gap. The vertical axis holds zero.
    """
    values = {name: np.asarray(v, dtype=np.float64).ravel() for name, v in curves.items()}
    longest = max((len(v) for v in values.values()), default=0)
    at = np.arange(longest, dtype=np.float64)
    x_range = _limits(at)
    y_range = _limits(np.concatenate([*values.values(), [0.0]]))
    parts = [_axes(x_range, y_range, x_label, y_label)]
    for k, series in enumerate(values.values()):
        for path in _paths(_x(at[: len(series)], x_range), _y(series, y_range)):
            color = _COLORS[k % len(_COLORS)]
            parts.append(f'<path d="{path}" fill="none" stroke="{color}" stroke-width="1.6"/>')
    return _svg(parts, _legend(list(values)) if len(values) > 1 else "")


def heat_chart(rows: ArrayLike, *, y_label: str = "") -> str:
    """Draw ``rows`` (K, N) as a heat map, a row a band, as an SVG element. For many curves at once."""
    from PIL import Image as PilImage

    from toolkit.rendering.colormap import ColorScale

    field = np.asarray(rows, dtype=np.float64)
    scale = ColorScale.unsigned(field, percentile=99.5, cmap="magma")
    buffer = io.BytesIO()
    PilImage.fromarray(scale.colors(field)).save(buffer, "PNG")
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    plot_width, plot_height = _WIDTH - _LEFT - _RIGHT, _HEIGHT - _TOP - _BOTTOM
    picture = (
        f'<image x="{_LEFT}" y="{_TOP}" width="{plot_width}" height="{plot_height}" preserveAspectRatio="none" '
        f'style="image-rendering:pixelated" href="data:image/png;base64,{data}"/>'
    )
    axes = _axes((0.0, max(field.shape[1] - 1.0, 1.0)), (float(len(field)), 0.0), "frame", y_label)
    return _svg([axes, picture], f'<span class="key">0 – {scale.high:.3g}, dark to bright</span>')


def _limits(values: NDArray[np.float64]) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    return (low, high) if high > low else (low, low + (abs(low) or 1.0))


def _x(values: ArrayLike, limits: tuple[float, float]) -> NDArray[np.float64]:
    return _LEFT + (np.asarray(values) - limits[0]) / (limits[1] - limits[0]) * (_WIDTH - _LEFT - _RIGHT)


def _y(values: ArrayLike, limits: tuple[float, float]) -> NDArray[np.float64]:
    share = (np.asarray(values) - limits[0]) / (limits[1] - limits[0])
    return _HEIGHT - _BOTTOM - share * (_HEIGHT - _TOP - _BOTTOM)


def _paths(px: NDArray[np.float64], py: NDArray[np.float64]) -> list[str]:
    """One path for each unbroken run of finite values."""
    good = np.isfinite(py)
    runs = np.split(np.arange(len(py)), np.nonzero(np.diff(good))[0] + 1)
    return ["M" + "L".join(f"{px[i]:.1f} {py[i]:.1f}" for i in run) for run in runs if len(run) and good[run[0]]]


def _axes(x_range: tuple[float, float], y_range: tuple[float, float], x_label: str, y_label: str) -> str:
    bottom, right = _HEIGHT - _BOTTOM, _WIDTH - _RIGHT
    parts = [f'<path class="axis" d="M{_LEFT} {_TOP}V{bottom}H{right}"/>']
    for value in _ticks(x_range, 8):
        px = _x(value, x_range)
        parts.append(f'<line class="axis" x1="{px:.1f}" x2="{px:.1f}" y1="{bottom}" y2="{bottom + 4}"/>')
        parts.append(f'<text x="{px:.1f}" y="{bottom + 16}" text-anchor="middle">{value:.6g}</text>')
    for value in _ticks(y_range, 4):
        py = _y(value, y_range)
        parts.append(f'<line class="grid" x1="{_LEFT}" x2="{right}" y1="{py:.1f}" y2="{py:.1f}"/>')
        parts.append(f'<text x="{_LEFT - 7}" y="{py + 4:.1f}" text-anchor="end">{value:.6g}</text>')
    middle = (_TOP + bottom) / 2
    parts.append(f'<text x="{(_LEFT + right) / 2}" y="{_HEIGHT - 6}" text-anchor="middle">{escape(x_label)}</text>')
    turned = f'transform="rotate(-90 13 {middle})" text-anchor="middle"'
    parts.append(f'<text x="13" y="{middle}" {turned}>{escape(y_label)}</text>')
    return "".join(parts)


def _ticks(limits: tuple[float, float], count: int) -> list[float]:
    from matplotlib.ticker import MaxNLocator

    low, high = min(limits), max(limits)
    at = MaxNLocator(nbins=count, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    slack = 1e-9 * (high - low)
    return [float(t) for t in at if low - slack <= t <= high + slack]


def _legend(names: Sequence[str]) -> str:
    return "".join(
        f'<span class="key"><i style="background:{_COLORS[k % len(_COLORS)]}"></i>{escape(name)}</span>'
        for k, name in enumerate(names)
    )


def _svg(parts: Sequence[str], legend: str) -> str:
    body = "".join(parts)
    chart = f'<svg class="chart" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img">{body}</svg>'
    return f'{chart}<div class="legend">{legend}</div>' if legend else chart
