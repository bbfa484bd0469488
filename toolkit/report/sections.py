"""The report's sections, one a stage, each with a few sentences on what to look for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from toolkit.report.charts import heat_chart, line_chart
from toolkit.report.data import Chart, Figure, Section

__all__ = [
    "bases_section",
    "decomposition_section",
    "details_section",
    "performance_section",
    "registration_section",
    "timings_section",
    "transfer_section",
]

Numbers = Mapping[str, Any]
_MOST_CURVES = 6


def performance_section(figures: Sequence[Figure]) -> Section:
    """Source above result, the same frames."""
    return Section(
        "The performance",
        "Source above, result below, the same frames. Each column should show the same expression, with wrinkles in "
        "the same places; lips and eyes should close where the source's do.",
        figures,
    )


def registration_section(figures: Sequence[Figure], numbers: Numbers) -> Section:
    """How the source's mesh was brought into the target's shape."""
    return Section(
        "Registration",
        "The source's mesh bent into the target's shape. Everything else builds on it: if lids, lips or nostrils "
        "are not where they belong here, the result cannot be right. More landmarks there help most.",
        figures,
        numbers=numbers,
    )


def decomposition_section(figures: Sequence[Figure], numbers: Numbers) -> Section:
    """Large-scale shape and coating."""
    return Section(
        "Shape and detail",
        "Every frame is split into a smooth large-scale shape and a coating of fine detail. Wrinkles should be in the "
        "coating and not in the smooth shape; if they are in both, give the smoothing a longer wavelength.",
        figures,
        numbers=numbers,
    )


def bases_section(
    figures: Sequence[Figure], weights: ArrayLike, errors: ArrayLike, unit: str, numbers: Numbers
) -> Section:
    """The chosen frames, their weights ``(T, K)`` over time, and the error ``(K + 1,)`` with the first 0..K of them."""
    table, curve = np.asarray(weights, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    charts = []
    if curve.size:
        svg = line_chart({"error": curve}, x_label="bases", y_label=f"RMS ({unit})")
        charts.append(Chart(svg, "What is left of the motion with so many bases; it should level off."))
    if table.size and table.shape[1] <= _MOST_CURVES:
        curves = {f"basis {k + 1}": table[:, k] for k in range(table.shape[1])}
        charts.append(Chart(line_chart(curves, y_label="weight"), "How much of each basis is in each frame."))
    elif table.size:
        charts.append(Chart(heat_chart(table.T, y_label="basis"), "How much of each basis (row) is in each frame."))
    return Section(
        "Bases",
        "A few frames of the take whose mixtures, with weights that are never negative, give its large-scale motion. "
        "Only these are transferred; the weights are kept. Each target face should be a fair likeness of the "
        "expression above it.",
        figures,
        charts,
        numbers,
    )


def transfer_section(
    figures: Sequence[Figure], gaps: Mapping[str, Mapping[str, ArrayLike]], numbers: Numbers
) -> Section:
    """Quality of the large-scale transfer; ``gaps`` names an opening and gives its curves (T,) by face."""
    charts = [
        Chart(
            line_chart(pair, y_label="gap (% of the face's height)"),
            f"{name}: mean gap between its rims in every frame.",
        )
        for name, pair in gaps.items()
    ]
    return Section(
        "Transfer",
        "The bases' motion carried to the target by deformation transfer, with lips and lids made to meet where the "
        "source's do: the two curves of an opening should touch the ground in the same frames. The colours show how "
        "far each point moves; the pattern should match between the two faces.",
        figures,
        charts,
        numbers,
    )


def details_section(source_energy: ArrayLike, result_energy: ArrayLike, unit: str, numbers: Numbers) -> Section:
    """Strength of the motion detail in every frame (T,), source and result."""
    curves = {"source": source_energy, "result": result_energy}
    caption = "Strength of the moving wrinkles (RMS over the face); both curves should rise and fall together."
    return Section(
        "Wrinkles",
        "Fine detail that comes and goes with the expression, carried over in local frames of the surface.",
        charts=[Chart(line_chart(curves, y_label=f"RMS ({unit})"), caption)],
        numbers=numbers,
    )


def timings_section(seconds: Mapping[str, float]) -> Section:
    """Wall-clock seconds of each stage."""
    rows: dict[str, Any] = {f"{name} (s)": round(value, 2) for name, value in seconds.items()}
    if len(seconds) > 1:
        rows["total (s)"] = round(sum(seconds.values()), 2)
    return Section("Timings", "Time of each stage when it last ran.", numbers=rows)
