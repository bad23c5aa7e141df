"""One row of records.csv or records.xlsx changed or added, everything else as it was.

What a person typed stays to the byte: their columns, comments, separators and line ends. The file
is replaced whole, and only if it is still the one that was read.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from vinesexp.errors import CampaignError
from vinesexp.records.campaign.problems import Problems
from vinesexp.records.campaign.records_csv import (
    Sheet,
    column_of,
    decoded,
    separator_of,
    sheet_rows,
)
from vinesexp.records.campaign.records_xlsx import edited_workbook
from vinesexp.whole_files import write_whole

_MARK = b"\xef\xbb\xbf"  # of UTF-8, as spreadsheets write it


def row_of(sheet: Path, record: str) -> dict[str, str]:
    """The cells of a record by column; CampaignError where there is no such row."""
    found = _read(sheet)
    line = _line(found, record, sheet)
    return found.row(dict(found.body)[line])


def change_row(sheet: Path, record: str, cells: Mapping[str, str]) -> None:
    """Write cells into the row of a record; columns that are not there yet are added.

    Parameters
    ----------
    sheet : Path
        records.csv or records.xlsx.
    record : str
        Its name.
    cells : mapping
        Column to text.

    Raises
    ------
    CampaignError
        There is no such row any more.
    """
    found = _read(sheet)
    _write(sheet, found, _line(found, record, sheet), dict(cells))


def add_row(sheet: Path, cells: Mapping[str, str]) -> None:
    """A new row at the end."""
    found = _read(sheet)
    _write(sheet, found, None, dict(cells))


def _read(sheet: Path) -> Sheet:
    problems = Problems(sheet)
    found = sheet_rows(sheet, problems)
    if found is None:
        raise problems.found[0]
    return found


def _line(found: Sheet, record: str, sheet: Path) -> int:
    for line, cells in found.body:
        if found.row(cells).get("record") == record:
            return line
    raise CampaignError(f"holds no record '{record}' any more; look at the table", file=sheet)


def _write(sheet: Path, found: Sheet, line: int | None, cells: dict[str, str]) -> None:
    content = sheet.read_bytes()
    changed = (
        _changed_workbook(content, found, line, cells)
        if sheet.suffix == ".xlsx"
        else _changed_text(content, line, cells)
    )
    write_whole(sheet, changed)


def _changed_workbook(
    content: bytes, found: Sheet, line: int | None, cells: dict[str, str]
) -> bytes:
    header = list(found.header)
    for column in [c for c in cells if c not in header]:
        content = edited_workbook(content, 1, {len(header): column})
        header.append(column)
    last = found.body[-1][0] if found.body else 1
    row = {header.index(column): text for column, text in cells.items()}
    return edited_workbook(content, last + 1 if line is None else line, row)


def _changed_text(content: bytes, line: int | None, cells: dict[str, str]) -> bytes:
    """Of a CSV only the lines of the row, and the head where a column is new, are written anew."""
    text, encoding = decoded(content)
    end = "\r\n" if "\r\n" in text else "\n"
    separator = separator_of(text)
    pieces = _pieces(text, separator)
    head = next(k for k, one in enumerate(pieces) if any(cell.strip() for cell in one.cells))
    header = [column_of(cell) for cell in pieces[head].cells]
    new = [column for column in cells if column not in header]
    if new:
        while header and not header[-1]:
            header.pop()
        titles = [*pieces[head].cells[: len(header)], *new]
        pieces[head] = _Piece(pieces[head].line, _line_of(titles, separator) + end, titles)
        header += new
    if line is None:
        last = pieces[-1]
        if not last.text.endswith(("\n", "\r")):
            pieces[-1] = _Piece(last.line, last.text + end, last.cells)
        row = [cells.get(column, "") for column in header]
        pieces.append(_Piece(0, _line_of(row, separator) + end, row))
    else:
        at = next(k for k, one in enumerate(pieces) if one.line == line)
        old = pieces[at]
        row = [*old.cells, *[""] * (len(header) - len(old.cells))]
        for column, cell in cells.items():
            row[header.index(column)] = cell
        tail = old.text[len(old.text.rstrip("\r\n")) :]
        pieces[at] = _Piece(line, _line_of(row, separator) + tail, row)
    joined = "".join(one.text for one in pieces).encode(encoding)
    return _MARK + joined if content.startswith(_MARK) else joined


@dataclass(frozen=True)
class _Piece:
    """A row as it stands in the file, line ends included, and its cells; begins at `line`."""

    line: int
    text: str
    cells: list[str]


def _pieces(text: str, separator: str) -> list[_Piece]:
    """The text row by row; a row may go over several lines."""
    lines = list(io.StringIO(text, newline=""))
    reader = csv.reader(lines, delimiter=separator)
    pieces: list[_Piece] = []
    done = 0
    for row in reader:
        pieces.append(_Piece(done + 1, "".join(lines[done : reader.line_num]), row))
        done = reader.line_num
    return pieces


def _line_of(row: list[str], separator: str) -> str:
    stream = io.StringIO()
    csv.writer(stream, delimiter=separator).writerow(row)  # ends a line as what it has to quote
    return stream.getvalue().removesuffix("\r\n")
