"""Excel workbooks, .xlsx and .xls: the sheet with most rows, laid out as a text file would be.

Another sheet is named behind the file, as in ``book.xlsx#Run 2``. One has to be named where several
sheets of like length begin with the same row: they are records of one kind. Names, units, preamble
and stamps of a sheet are found as in text: its cells are written to a file aside first, one line a
row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import datetime, time
from functools import partial
from pathlib import Path
from typing import Any

from vinesexp.errors import RecordError
from vinesexp.records.readers.source import file_aside, file_of, part_of
from vinesexp.records.readers.text import TextSource
from vinesexp.records.readers.unread import need

NAME = "Excel (.xlsx, .xls)"
LIBRARIES = ("openpyxl", "xlrd")

_XLS = b"\xd0\xcf\x11\xe0"
_LIKE = 2  # times the rows of a sheet that the longest may have to be of like length


def recognises(head: bytes, suffix: str) -> bool:
    """A zip archive that begins with the parts of a workbook, or the old compound file."""
    if head.startswith(b"PK\x03\x04"):
        return b"[Content_Types].xml" in head or b"xl/" in head or suffix in (".xlsx", ".xlsm")
    return head.startswith(_XLS)


def open_file(path: Path) -> TextSource:
    """Read the sheet with most rows; RecordError where none holds columns of numbers."""
    with file_of(path).open("rb") as stream:
        old = stream.read(4) == _XLS
    module = need("xlrd" if old else "openpyxl", extra="excel", what="an Excel workbook")
    sheets = (_xls if old else _xlsx)(module, file_of(path))
    longest = max(sheets, key=lambda one: one.count)
    wanted = part_of(path)
    chosen = next((one for one in sheets if one.name == wanted), None) if wanted else longest
    if chosen is None:
        names = ", ".join(f"'{one.name}'" for one in sheets)
        raise RecordError(f"no sheet '{wanted}'; there are {names}")
    aside, text = file_aside()
    aside.writelines(f"{_line(row)}\n".encode() for row in chosen.rows())
    source = TextSource(path, aside, text, of=f"sheet '{chosen.name}'", line="row")
    source.format = "Excel"
    alike = [one.name for one in sheets if _LIKE * one.count >= longest.count]
    heads = {_line(next(iter(one.rows()), ())) for one in sheets if one.name in alike}
    if len(alike) > 1 and len(heads) == 1:
        source.parts = tuple(alike)
    if len(sheets) > 1:
        source.format = f"Excel, sheet '{chosen.name}' of {len(sheets)}"
    return source


@dataclass(frozen=True)
class _Sheet:
    """One sheet of a workbook: name, number of rows, and how to read them."""

    name: str
    count: int
    rows: Callable[[], Iterable[Iterable[Any]]]


def _xlsx(openpyxl: Any, path: Path) -> list[_Sheet]:
    book = openpyxl.load_workbook(path.open("rb"), read_only=True, data_only=True)
    return [
        _Sheet(one.title, one.max_row or 0, partial(one.iter_rows, values_only=True))
        for one in book.worksheets
    ]


def _xls(xlrd: Any, path: Path) -> list[_Sheet]:
    book = xlrd.open_workbook(path)

    def rows(sheet: Any) -> Iterator[list[Any]]:
        for i in range(sheet.nrows):
            yield [
                xlrd.xldate_as_datetime(cell.value, book.datemode)
                if cell.ctype == xlrd.XL_CELL_DATE
                else cell.value
                for cell in sheet.row(i)
            ]

    return [_Sheet(one.name, one.nrows, partial(rows, one)) for one in book.sheets()]


def _line(row: Iterable[Any]) -> str:
    return "\t".join(_cell(value) for value in row).rstrip("\t")


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
