"""records.xlsx: the table of records as a workbook, in the place of records.csv.

Its first sheet is read like the CSV. As written for a new campaign it has units in the heads, a
list of the kinds of test, and colours: what is proposed, and, as long as it is so, what is missing
or wrong; a second sheet says which colour is which.
"""

from __future__ import annotations

import io
from collections.abc import Collection, Mapping, Sequence
from datetime import date, datetime, time
from typing import Any

from vinesexp.records.campaign.missing_cells import FILL_IN
from vinesexp.records.campaign.problems import Problems
from vinesexp.records.campaign.schema import SHEET_COLUMNS, TESTS

#: Fill of a cell, and what it says.
_PROPOSED, _MISSING, _WRONG = "DDEBF7", "FFE699", "F8CBAD"
_LEGEND = (
    (_PROPOSED, "proposed from the file or its name: check it"),
    (_MISSING, "missing: no file tells it; if it does not apply, remove FILL IN from the note"),
    (_WRONG, "wrong: not a kind of test, not a number, or a record's name that is there twice"),
)
_UNITS = {"mm": "mm", "g": "g", "hz": "Hz"}
_WIDTHS = {"file": 34, "note": 70, "record": 24, "test": 12}
_NUMBERS = ("base_amplitude_mm", "added_mass_g", "release_mm")
_LAST_ROW = 2000  # as far as lists and colours reach


def head_of(column: str) -> str:
    """The head of a column, with its unit in brackets.

    Examples
    --------
    >>> head_of("added_mass_g"), head_of("file"), head_of("frequency_hz")
    ('added mass (g)', 'file', 'frequency (Hz)')
    """
    name, _, unit = column.rpartition("_")
    return f"{name.replace('_', ' ')} ({_UNITS[unit]})" if unit in _UNITS else column


def rows_of_workbook(content: bytes, problems: Problems) -> list[tuple[int, list[str]]]:
    """The rows of the first sheet with their numbers; what is wrong goes to `problems`."""
    sheets = _opened(content, problems)
    if sheets is None:
        return []
    rows: list[tuple[int, list[str]]] = []
    for line, (cells, written) in enumerate(zip(*sheets, strict=True), start=1):
        rows.append((line, [_text(cell.value) for cell in cells]))
        for cell, formula in zip(cells, written, strict=True):
            if cell.value is None and formula.value is not None:
                problems.add(
                    "holds a formula without a value; open the workbook in a spreadsheet and "
                    "save it",
                    where=f"sheet 1, cell {formula.coordinate}",
                )
    return rows


def cell_name(line: int, index: int) -> str:
    """A cell as spreadsheets call it.

    Examples
    --------
    >>> cell_name(3, 1), cell_name(12, 27)
    ('B3', 'AB12')
    """
    from openpyxl.utils import get_column_letter

    return f"{get_column_letter(index + 1)}{line}"


def edited_workbook(content: bytes, cells: Mapping[tuple[int, int], str]) -> bytes:
    """The workbook with some cells changed; its looks stay.

    Parameters
    ----------
    content : bytes
        Of the file.
    cells : mapping
        Row (from 1) and column (from 0) to text; numbers are written as numbers.
    """
    import openpyxl

    book = openpyxl.load_workbook(io.BytesIO(content))
    for (row, column), text in cells.items():
        book.worksheets[0].cell(row=row, column=column + 1).value = _value(text)
    return _saved(book)


def new_workbook(
    rows: Sequence[Mapping[str, str]], *, proposed: Sequence[Collection[str]] = ()
) -> bytes:
    """records.xlsx of a new campaign.

    Parameters
    ----------
    rows : sequence of mappings
        Column to cell, as in records.csv.
    proposed : sequence of collections, optional
        For each row the columns that a person should look at.
    """
    import openpyxl
    from openpyxl.styles import Font, PatternFill

    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "records"
    columns = [*SHEET_COLUMNS, *["setup"] * any(row.get("setup") for row in rows)]
    sheet.append([head_of(column) for column in columns])
    for number, row in enumerate(rows):
        sheet.append([_value(row.get(column, "")) for column in columns])
        for index, column in enumerate(SHEET_COLUMNS, start=1):
            if number < len(proposed) and column in proposed[number]:
                cell = sheet.cell(row=number + 2, column=index)
                cell.fill = PatternFill("solid", start_color=_PROPOSED)
    for index, column in enumerate(columns, start=1):
        sheet.cell(row=1, column=index).font = Font(bold=True)
        letter = cell_name(1, index - 1)[:-1]
        sheet.column_dimensions[letter].width = _WIDTHS.get(column, 20)
    sheet.freeze_panes = "B2"
    _lists(sheet)
    _colours(sheet)
    _legend(book.create_sheet("colours"))
    return _saved(book)


def _lists(sheet: Any) -> None:
    """Kinds of test and yes or no to choose from."""
    from openpyxl.worksheet.datavalidation import DataValidation

    for column, choices in (("test", TESTS), ("exclude", ("yes", "no"))):
        listed = DataValidation(type="list", formula1=f'"{",".join(choices)}"', allow_blank=True)
        listed.error = f"expected one of: {', '.join(choices)}"
        listed.errorTitle = column
        listed.showErrorMessage = True
        sheet.add_data_validation(listed)
        listed.add(_range(column))


def _colours(sheet: Any) -> None:
    """Colours that follow what is written: gone as soon as a cell is filled in or put right."""
    from openpyxl.formatting.rule import FormulaRule
    from openpyxl.styles import PatternFill

    def when(column: str, formula: str, colour: str) -> None:
        fill = PatternFill("solid", start_color=colour, end_color=colour)
        sheet.conditional_formatting.add(
            _range(column), FormulaRule(formula=[formula], fill=fill, stopIfTrue=True)
        )

    note = _first("note")
    for column in SHEET_COLUMNS[3:8]:
        asked = f'ISNUMBER(SEARCH("{FILL_IN}*{column}",{note}))'
        when(column, f'AND({_first(column)}="",{asked})', _MISSING)
    test, record = _first("test"), _first("record")
    known = "+".join(f'({test}="{name}")' for name in TESTS)
    when("test", f'AND({record}<>"",({known})=0)', _WRONG)
    when("record", f'AND({record}<>"",COUNTIF($A$2:$A${_LAST_ROW},{record})>1)', _WRONG)
    for column in _NUMBERS:
        cell = _first(column)
        when(column, f'AND({cell}<>"",NOT(ISNUMBER({cell})))', _WRONG)
        when(column, f"AND(ISNUMBER({cell}),{cell}<0)", _WRONG)
    cell = _first("clearance_mm")
    when("clearance_mm", f"AND(ISNUMBER({cell}),{cell}<=0)", _WRONG)


def _legend(sheet: Any) -> None:
    from openpyxl.styles import PatternFill

    for line, (colour, meaning) in enumerate(_LEGEND, start=1):
        sheet.cell(row=line, column=1).fill = PatternFill("solid", start_color=colour)
        sheet.cell(row=line, column=2).value = meaning
    sheet.column_dimensions["B"].width = 90


def _first(column: str) -> str:
    """The cell of a column in the first row below the heads, its column fixed."""
    return "$" + cell_name(2, SHEET_COLUMNS.index(column))


def _range(column: str) -> str:
    letter = cell_name(2, SHEET_COLUMNS.index(column))[:-1]
    return f"{letter}2:{letter}{_LAST_ROW}"


def _opened(content: bytes, problems: Problems) -> tuple[Any, Any] | None:
    """The first sheet with its values, and with its formulas."""
    import openpyxl

    try:
        books = [
            openpyxl.load_workbook(io.BytesIO(content), data_only=values)
            for values in (True, False)
        ]
        values, formulas = (book.worksheets[0].iter_rows() for book in books)
        return values, formulas
    except Exception as error:  # whatever a damaged workbook makes of the library
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        problems.add(f"cannot be read as a workbook ({reason}); save it again as .xlsx")
        return None


def _text(value: object) -> str:
    """A cell as records.csv would have it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:.12g}"
    if isinstance(value, datetime):
        midnight = value.time() == time()
        return value.date().isoformat() if midnight else value.isoformat(sep=" ")
    if isinstance(value, date | time):
        return value.isoformat()
    return str(value).strip()


def _value(text: str) -> str | float | None:
    """Numbers as numbers, so that a spreadsheet can compute with them."""
    try:
        value = float(text)
    except ValueError:
        return text or None
    return value if abs(value) < float("inf") and f"{value:.12g}" == text else text


def _saved(book: Any) -> bytes:
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()
