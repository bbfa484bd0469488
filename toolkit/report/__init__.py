"""One self-contained HTML page about a shot: pictures, curves, numbers, and how to judge them."""

from toolkit.report.charts import heat_chart, line_chart
from toolkit.report.data import Chart, Figure, ReportData, Section
from toolkit.report.page import build

__all__ = ["Chart", "Figure", "ReportData", "Section", "build", "heat_chart", "line_chart"]
