"""Excel workbooks, .xlsx and .xls: the sheet with most rows of numbers, laid out as text would be.

Another sheet is named behind the file, as in ``book.xlsx#Run 2``. One has to be named where several
sheets of like length begin with the same row: they are records of one kind. Names, units, preamble
and stamps of a sheet are found as in text: its cells are written to a file aside first, one line a
row.
"""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime, time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vinesexp.errors import RecordError
from vinesexp.records.readers.layout import Layout, Lines
from vinesexp.records.readers.source import file_of, part_of
from vinesexp.records.readers.text import TextSource, laid_aside, turned
from vinesexp.records.readers.unread import need

if TYPE_CHECKING:
    import pandas as pd

NAME = "Excel (.xlsx, .xls)"
LIBRARIES = ("pandas", "openpyxl", "xlrd")
_AS_TEXT = tuple(Layout("utf-8", "\t", sign) for sign in ".,")  # numbers in cells of text

_XLS = b"\xd0\xcf\x11\xe0"
_LIKE = 2  # times the rows of a sheet that the longest may have to be of like length


def recognises(head: bytes, suffix: str) -> bool:
    """A zip archive that begins with the parts of a workbook, or the old compound file."""
    if head.startswith(b"PK\x03\x04"):
        return b"[Content_Types].xml" in head or b"xl/" in head or suffix in (".xlsx", ".xlsm")
    return head.startswith(_XLS)


def open_file(path: Path) -> TextSource:
    """Read the sheet with most rows of numbers; RecordError where none holds columns of numbers."""
    import pandas as pd

    file = file_of(path).open("rb")
    engine: Literal["xlrd", "openpyxl"] = "xlrd" if file.read(4) == _XLS else "openpyxl"
    need(engine, extra="excel", what="an Excel workbook")
    sheets = pd.read_excel(
        file, sheet_name=None, header=None, dtype=object, na_filter=False, engine=engine
    )
    counts = {one: _rows_of_numbers(rows) for one, rows in sheets.items()}
    if not any(counts.values()):  # numbers with their units
        counts = {one: len(rows) for one, rows in sheets.items()}
    most, wanted = max(counts.values()), part_of(path)
    name = wanted or next(one for one, count in counts.items() if count == most)
    if name not in sheets:
        names = ", ".join(f"'{one}'" for one in sheets)
        raise RecordError(f"no sheet '{wanted}'; there are {names}")
    lines = (f"{_line(row)}\n" for row in sheets[name].itertuples(index=False))
    called = Lines("row", of=f"sheet '{name}'")
    try:
        aside = laid_aside(lines)
        source = TextSource(path, *(turned(aside[1]) or (*aside, called)))
    except RecordError as error:
        where = error.where or called.of
        raise RecordError(error.problem, where=where, remedy=error.remedy) from None
    source.format = "Excel"
    alike = [one for one, count in counts.items() if _LIKE * count >= most]
    heads = {_line(next(sheets[one].itertuples(index=False), ())) for one in alike}
    if len(alike) > 1 and len(heads) == 1:
        source.parts = tuple(alike)
    if len(sheets) > 1:
        source.format = f"Excel, sheet '{name}' of {len(sheets)}"
    return source


def _rows_of_numbers(sheet: pd.DataFrame) -> int:
    """How many rows may hold samples: words alone, as of a device's settings, are none."""
    numbers = [
        isinstance(cell, (int, float))
        or (isinstance(cell, str) and any(one.is_number(cell) for one in _AS_TEXT))
        for cell in sheet.to_numpy().flat
    ]
    return int(np.reshape(numbers, sheet.shape).any(axis=1).sum()) if sheet.size else 0


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
