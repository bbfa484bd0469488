"""Writers of a performance: one entry, `export`, and the formats glTF, USD, Alembic, PC2, MDD, NumPy, OBJ and PLY."""

from toolkit.export.formats import FORMATS, ExportReport, Format, export, file_name
from toolkit.export.performance import Performance

__all__ = ["FORMATS", "ExportReport", "Format", "Performance", "export", "file_name"]
