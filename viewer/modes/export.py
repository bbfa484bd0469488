"""Export: write the result, edits included, for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from toolkit.errors import InputError
from toolkit.export import FORMATS
from toolkit.progress import Progress
from viewer.modes.base import Mode
from viewer.stages_process import export_in_process
from viewer.state.rows import Button, Check, Note, Row
from viewer.worker import Cancelled

if TYPE_CHECKING:
    from viewer.state.app import App

__all__ = ["ExportMode"]


class ExportMode(Mode):
    """Choose formats, write them in a process of their own."""

    name = "export"
    title = "Export"
    pairs = ("performance", "before_after", "map")

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._chosen = {"gltf"}
        self._written: list[str] = []

    def hint(self) -> str:
        """What the mode is for."""
        return "choose formats and press Export; the frames are brought up to date first"

    def rows(self) -> Sequence[Row]:
        """Formats, the button, what was written."""
        rows: list[Row] = [
            Check(f"format:{name}", format.words, name in self._chosen) for name, format in FORMATS.items()
        ]
        ready = self.app.data.has_result and bool(self._chosen) and self.app.worker.progress is None
        rows.append(Button("export now", "Export", ready))
        rows.append(Note(f"into {self.app.shot.export_folder}", "quiet"))
        count = sum(edit.on for edit in self.app.editing.edits)
        if count:
            rows.append(Note(f"with {count} edit{'s' if count > 1 else ''}", "quiet"))
        rows += [Note(line, "good") for line in self._written]
        return rows

    def panel(self, name: str, value: Any, final: bool) -> None:
        """Choose a format, or export."""
        if name.startswith("format:"):
            (self._chosen.add if value else self._chosen.discard)(name[7:])
        elif name == "export now":
            self._export()

    def _export(self) -> None:
        formats = [name for name in FORMATS if name in self._chosen]
        if not formats:
            raise InputError("no format is chosen", remedy="tick one")
        folder = self.app.shot.path

        def work(progress: Progress) -> list[dict[str, Any]]:
            self.app.saver.flush()
            return export_in_process(folder, formats, progress)

        def done(reports: list[dict[str, Any]]) -> None:
            self._written = [_in_words(report) for report in reports]
            count = f"{len(reports)} format{'s' if len(reports) > 1 else ''}"
            self.app.say(f"{count} exported to {self.app.shot.export_folder}", "good")
            self.app.result_written()

        def failed(error: Exception) -> None:
            stopped = isinstance(error, Cancelled)
            self.app.say("the export is stopped" if stopped else str(error), "bad")
            self.app.touch("panel")

        self._written = []
        self.app.run_task("exporting", work, done, failed=failed)


def _in_words(report: dict[str, Any]) -> str:
    name = str(report["path"]).rsplit("/", 1)[-1]
    words = f"{name}: {report['n_frames']} frames, {report['n_bytes'] / 1e6:.1f} MB"
    if report.get("rms_deviation"):
        words += f", {report['rms_deviation']:.2g} RMS from the exact frames"
    return words
