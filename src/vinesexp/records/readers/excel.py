"""Excel workbooks, .xlsx and .xls: the sheet with most rows, laid out as a text file would be.

Names, units, preamble and stamps of a sheet are found as in text: its cells are written to an
unnamed text file first, one line a row.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from datetime import datetime, time
from pathlib import Path
from typing import Any

from vinesexp.errors import RecordError
from vinesexp.records.readers.extras import need, unreadable
from vinesexp.records.readers.source import BLOCK_ROWS, Floats
from vinesexp.records.readers.text import TextSource

NAME = "Excel (.xlsx, .xls)"
LIBRARIES = ("openpyxl", "xlrd")

_XLS = b"\xd0\xcf\x11\xe0"


def recognises(head: bytes, suffix: str) -> bool:
    """A zip archive that begins with the parts of a workbook, or the old compound file."""
    if head.startswith(b"PK\x03\x04"):
        return b"[Content_Types].xml" in head or b"xl/" in head or suffix in (".xlsx", ".xlsm")
    return head.startswith(_XLS)


def open_file(path: Path) -> SheetSource:
    """Read the sheet with most rows; RecordError where none holds columns of numbers."""
    with path.open("rb") as stream:
        old = stream.read(4) == _XLS
    module = need("xlrd" if old else "openpyxl", extra="excel", what="an Excel workbook", path=path)
    try:
        name, rows = _xls(module, path) if old else _xlsx(module, path)
    except Exception as error:  # whatever the broken bytes lead to
        raise unreadable("an Excel workbook", error, path) from None
    return SheetSource(path, name, rows)


class SheetSource(TextSource):
    """One sheet of a workbook. The interface is `readers.source.Source`."""

    format = "Excel"

    def __init__(self, path: Path, sheet: str, rows: Iterable[Iterable[Any]]) -> None:
        self._text = tempfile.NamedTemporaryFile("w", suffix=".tsv", encoding="utf-8")  # noqa: SIM115
        try:
            for row in rows:
                self._text.write("\t".join(_cell(value) for value in row).rstrip("\t") + "\n")
        except Exception as error:
            raise unreadable("an Excel workbook", error, path) from None
        self._text.flush()
        try:
            super().__init__(Path(self._text.name))
        except RecordError as error:
            raise self._meant(error, path, sheet) from None
        self._sheet = sheet
        self._workbook = path
        self._read_from, self.path = self.path, path

    def blocks(self, columns: Any, rows: int = BLOCK_ROWS) -> Iterator[Floats]:
        """Blocks of the given columns; see `Source.blocks`."""
        try:
            yield from super().blocks(columns, rows)
        except RecordError as error:
            raise self._meant(error, self._workbook, self._sheet) from None

    def locate(self, row: int) -> str:
        """``"row 12"`` of the sheet."""
        return super().locate(row).replace("line", "row")

    @staticmethod
    def _meant(error: RecordError, path: Path, sheet: str) -> RecordError:
        where = (error.where or "").replace("line", "row")
        place = f"sheet '{sheet}'" + (f", {where}" if where else "")
        return RecordError(error.problem.replace("line ", "row "), file=path, where=place)


def _xlsx(openpyxl: Any, path: Path) -> tuple[str, Iterable[Iterable[Any]]]:
    book = openpyxl.load_workbook(path, read_only=True, data_only=True)
    sheet = max(book.worksheets, key=lambda one: one.max_row or 0)
    return sheet.title, sheet.iter_rows(values_only=True)


def _xls(xlrd: Any, path: Path) -> tuple[str, Iterable[Iterable[Any]]]:
    book = xlrd.open_workbook(path)
    sheet = max(book.sheets(), key=lambda one: one.nrows)

    def rows() -> Iterator[list[Any]]:
        for i in range(sheet.nrows):
            yield [
                xlrd.xldate_as_datetime(cell.value, book.datemode)
                if cell.ctype == xlrd.XL_CELL_DATE
                else cell.value
                for cell in sheet.row(i)
            ]

    return sheet.name, rows()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (datetime, time)):
        return value.isoformat(*([" "] if isinstance(value, datetime) else []))
    return " ".join(str(value).split()).replace('"', "'")
