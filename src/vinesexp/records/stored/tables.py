"""Reading and writing the tables of a results folder: CSV with a header line, one form for all.

A table knows its columns (`vinesexp.records.stored.result_columns` lists them). What is written is
checked against them, and what is read too: a table that was damaged or cut off never passes for a
whole one.
"""

from __future__ import annotations

import csv
import difflib
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vinesexp.arrays import FloatArray
from vinesexp.errors import TableError

if TYPE_CHECKING:
    import pandas

#: A cell before it is written: None and NaN become empty cells.
Value = str | float | int | None
#: A row as it was read: numbers as numbers, None where a cell of a number is empty, else text.
Row = Mapping[str, Any]
#: Text that a spreadsheet would run as a formula: it is written behind an apostrophe.
_FORMULA = re.compile(r"[=+\-@\t\r]")


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    name : as in the header line.
    kind : ``text``, ``number`` (may be empty: not known), ``whole`` (an integer), or ``any``: a
        number where it is one, else text.
    form : format of a number; empty: the shortest text that reads back the same.
    needed : whether a table without this column is refused.
    """

    name: str
    kind: str = "text"
    form: str = ""
    needed: bool = True


def columns(words: str) -> tuple[Column, ...]:
    """Columns by name, each that is not text with its kind or format: ``nes:whole``, ``x_m:.9g``.

    A format alone is that of a number. A column that a table may lack ends with a question mark.

    Examples
    --------
    >>> columns("note? x:.3g found:any:.6g")[1:]
    (Column(name='x', kind='number', form='.3g', needed=True), \
Column(name='found', kind='any', form='.6g', needed=True))
    """
    found = []
    for word in words.split():
        name, *kinds = word.removesuffix("?").split(":")
        form = next((one for one in kinds if one.startswith(".")), "")
        kind = "number" if kinds[:1] == [form] else next(iter(kinds), "text")
        found.append(Column(name, kind, form, needed=word[-1] != "?"))
    return tuple(found)


@dataclass(frozen=True)
class Table:
    """A table of the results folder.

    Attributes
    ----------
    name : as programs call it.
    step : that writes it.
    columns : in their order.
    file : where it lies, from the results folder.
    answers : the question it answers, for docs and exports.
    """

    name: str
    step: str
    columns: tuple[Column, ...]
    file: str = ""
    answers: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(column.name for column in self.columns)


def write_rows(path: Path, table: Table, rows: Iterable[Mapping[str, Value]]) -> None:
    """Write rows; a key that a row lacks is an empty cell.

    Parameters
    ----------
    path : Path
        Its folder is made where it is missing.
    table : Table
    rows : iterable of mappings
        Column to value. Text is written as it is, also in a column of numbers; in a column of text
        an apostrophe goes before what a spreadsheet takes for a formula. `read_rows` removes it.

    Raises
    ------
    KeyError
        A row has a key that is no column: a mistake of the caller, not of a user.

    Examples
    --------
    >>> import tempfile
    >>> table = Table("t", "make", columns("a x:.3g"))
    >>> path = Path(tempfile.mkdtemp()) / "t.csv"
    >>> write_rows(path, table, [{"a": "one, two", "x": 0.12345}, {"a": "none", "x": None}])
    >>> path.read_text().splitlines()
    ['a,x', '"one, two",0.123', 'none,']
    >>> read_rows(path, table)[0]
    {'a': 'one, two', 'x': 0.123}
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    known = {column.name: column for column in table.columns}
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, table.names, restval="", lineterminator="\n")
        writer.writeheader()
        for row in rows:
            writer.writerow({name: _cell(value, known[name]) for name, value in row.items()})


def write_columns(path: Path, table: Table, columns: Mapping[str, Sequence[Value]]) -> None:
    """Write a table whose values stand column by column, all of one length."""
    lists = (columns[name] for name in table.names)
    rows = (dict(zip(table.names, row, strict=True)) for row in zip(*lists, strict=True))
    write_rows(path, table, rows)


def _cell(value: Value, column: Column) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, float) and column.form:
        return format(value, column.form)
    # An apostrophe before a formula is doubled, so that reading gives back what was written.
    formula = column.kind == "text" and _FORMULA.match(str(value).lstrip("'"))
    return f"'{value}" if formula else str(value)


def read_rows(path: Path, table: Table) -> list[dict[str, Any]]:
    """Rows of a table, cells as their columns say; columns beside those of the table are kept.

    Raises
    ------
    TableError
        The file is missing, is another table, or is damaged: a cell too few or too many, a cell
        that is no number where one belongs, a last line that was cut off.
    """
    header, body = _cells(path, table)
    missing = [c.name for c in table.columns if c.needed and c.name not in header]
    if missing:
        alike = difflib.get_close_matches(missing[0], header, n=1)
        instead = f" but '{alike[0]}'" if alike else ""
        raise _damaged(path, table, f"has no column '{missing[0]}'{instead}", line=1)
    for line, cells in body:
        if len(cells) != len(header):
            raise _damaged(
                path, table, f"has {len(cells)} cells under {len(header)} columns", line=line
            )
    kinds = {column.name: column.kind for column in table.columns}
    read: list[list[Value]] = []
    for k, name in enumerate(header):
        kind = kinds.get(name)
        convert = _READ.get(kind or "", str)
        read.append(own := [])
        try:
            for row in body:
                own.append(convert(row[1][k]))
        except ValueError:
            line, cells = row
            expected = "a whole number" if kind == "whole" else "a number or nothing"
            found = f"found '{cells[k]}' in column {name}, expected {expected}"
            raise _damaged(path, table, found, line=line) from None
    return [dict(zip(header, row, strict=True)) for row in zip(*read, strict=True)]


def columns_of(rows: Sequence[Row], names: Iterable[str]) -> list[FloatArray]:
    """Columns of numbers of a table that was read; NaN in empty cells.

    Examples
    --------
    >>> columns_of([{"time_s": 1.0}, {"time_s": None}], ["time_s"])
    [array([ 1., nan])]
    """
    return [np.array([row[name] for row in rows], dtype=np.float64) for name in names]


def _text(cell: str) -> str:
    escaped = cell.startswith("'") and _FORMULA.match(cell.lstrip("'"))  # by `_cell`
    return cell[1:] if escaped else cell


def _any(cell: str) -> Value:
    text = _text(cell)
    with suppress(ValueError):
        return float(text)
    return text


#: Kind of a column to what its cells hold; ValueError of one that is no number and should be one.
_READ: Mapping[str, Callable[[str], Value]] = {
    "whole": int,
    "number": lambda cell: float(cell) if cell else None,
    "text": _text,
    "any": _any,
}


def _cells(path: Path, table: Table) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Header and rows with their line numbers."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        remedy = f"run the {table.step} step first"
        raise TableError("is missing", file=path, remedy=remedy) from None
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise _damaged(path, table, f"cannot be read ({reason})") from None
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        raise _damaged(path, table, "is cut off: the last line does not end", line=len(lines))
    reader = csv.reader(lines)
    body = []
    line = 1
    try:
        for cells in reader:
            if cells:
                body.append((line, cells))
            line = reader.line_num + 1
    except csv.Error as error:
        raise _damaged(path, table, f"is no CSV ({error})", line=line) from None
    if not body:
        raise _damaged(path, table, f"is empty, expected the columns {','.join(table.names)}")
    return body[0][1], body[1:]


def _damaged(path: Path, table: Table, what: str, *, line: int | None = None) -> TableError:
    where = None if line is None else f"line {line}"
    return TableError(what, file=path, where=where, remedy=f"run the {table.step} step again")


def read_frame(path: Path, table: Table | None) -> pandas.DataFrame:
    """A table as pandas reads it, for people; `table` None: one that a user put there.

    Raises
    ------
    TableError
        It is another table, or damaged.
    """
    import pandas

    try:
        found = pandas.read_csv(path)
    except (ValueError, OSError) as error:
        raise TableError(f"cannot be read ({error}); run the workflow again", file=path) from None
    if table is not None and table.columns[0].name not in found:
        missing = table.columns[0].name
        raise _damaged(path, table, f"has no column '{missing}'")
    return found


def ids_of(cell: str) -> tuple[str, ...]:
    """Ids of records in a cell that holds several.

    Examples
    --------
    >>> ids_of("a;b"), ids_of("")
    (('a', 'b'), ())
    """
    return tuple(id for id in cell.split(";") if id)
