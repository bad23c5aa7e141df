"""records.csv or records.xlsx: a row a record, read strictly; all mistakes with their place.

The table may have come out of a spreadsheet anywhere in the world: comma, semicolon or tab
between the cells, and decimal commas where the comma does not part the cells.

Where one row is changed or added, what a person typed stays to the byte: their columns, comments,
separators and line ends. The file is replaced whole, and only if it is still the one that was read.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar

from vinesexp.errors import CampaignError, NoRecordsError, ParameterError, nearest
from vinesexp.records.campaign.problems import Problems, named_file
from vinesexp.records.campaign.records_xlsx import cell_name, edited_workbook, rows_of_workbook
from vinesexp.records.campaign.schema import MOST_BALLS, SHEET_COLUMNS, TESTS, Campaign, Record
from vinesexp.settings.stages import changed_by_text
from vinesexp.units import refuse_impossible, yes_or_no
from vinesexp.whole_files import write_whole

COLUMNS = (*SHEET_COLUMNS[:-1], "settings", "setup", SHEET_COLUMNS[-1])

#: Columns for people: text, carried into the records and never used in them.
PEOPLE = (
    *("operator", "date", "time", "instrument", "place", "temperature", "temperature_c"),
    *("humidity", "comment", "notes"),
)

REQUIRED = COLUMNS[:3]
_MM = "displacement"  # what the columns in mm measure
T = TypeVar("T")

#: A row as it stands in the table: its line, and its columns with their cells.
RowText = tuple[int, tuple[tuple[str, str], ...]]

_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # Windows devices
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Line:
    """A row of the table: its number, its cells, and how it stands in a CSV, line ends included."""

    number: int
    cells: list[str]
    text: str = ""

    def __bool__(self) -> bool:
        return any(cell.strip() for cell in self.cells)


@dataclass(frozen=True)
class Sheet:
    """The table as text.

    Attributes
    ----------
    lines : all rows, empty ones included, of which one at least is not.
    comma : whether numbers may have decimal commas.
    workbook : whether it is a spreadsheet's.
    """

    lines: Sequence[Line]
    comma: bool
    workbook: bool = False

    @cached_property
    def head(self) -> Line:
        """The row that names the columns, up to the last name; titles may stand above it."""
        named = (one for one in self.lines if {*REQUIRED} <= {*map(column_of, one.cells)})
        first = next(named, None) or next(filter(None, self.lines))
        cells = [cell.strip() for cell in first.cells]
        while not cells[-1]:
            cells.pop()
        return replace(first, cells=cells)

    @cached_property
    def header(self) -> list[str]:
        """The columns."""
        return [column_of(head) for head in self.head.cells]

    @property
    def body(self) -> list[Line]:
        """The rows below the head that are not empty."""
        return [one for one in self.lines if one and one.number > self.head.number]

    def place(self, line: int, column: str = "") -> str:
        """Where a cell stands, as a person finds it."""
        if not self.workbook:
            return f"line {line}, column {column}" if column else f"line {line}"
        if column not in self.header:
            return f"sheet 1, row {line}" + (f", column {column}" if column else "")
        return f"sheet 1, cell {cell_name(line, self.header.index(column))} ({column})"

    def row(self, cells: Sequence[str]) -> dict[str, str]:
        """Column to cell of one line."""
        return {name: cell.strip() for name, cell in zip(self.header, cells, strict=False)}


def read_table(
    campaign: Campaign, *, allow_outside: bool, problems: Problems,
    known: MutableMapping[RowText, Record] | None = None,
) -> tuple[Record, ...]:  # fmt: skip
    """Read records.csv; what is wrong goes to `problems`, the rows that are right come back.

    Parameters
    ----------
    campaign : Campaign
        Without its records. Paths start from its folder; a row may change its settings, name one
        of its setups, and has as many balls as it gives masses for.
    allow_outside : bool
        Whether instrument files may lie outside the folder.
    known : mapping, optional
        Rows that were right when they were read before, with the same of all else; those of now
        are added. A table that grows by a row is then read at the cost of that row.
    """
    known = {} if known is None else known
    sheet = sheet_rows(problems)
    if sheet is None or not _header_is_right(sheet, problems):
        return ()
    records: list[Record] = []
    lines: dict[str, int] = {}
    columns = len(sheet.header)
    for line, cells in ((one.number, one.cells) for one in sheet.body):
        if any(cell.strip() for cell in cells[columns:]):
            problems.add(
                f"{len(cells)} cells under {columns} columns; put a cell that contains the "
                "separator in quotes",
                where=sheet.place(line),
            )
            continue
        row = sheet.row(cells)
        text = (line, tuple(row.items()))
        record = known.get(text) or _record(row, line, sheet, campaign, allow_outside, problems)
        # Names that differ only in case would share a file on many disks.
        key = row.get("record", "").lower()
        if key and key in lines:
            before = sheet.place(lines[key])
            problems.add(
                f"record '{row['record']}' is already in {before}; every record needs "
                "its own name (upper and lower case count as the same)",
                where=sheet.place(line, "record"),
            )
        lines.setdefault(key, line)
        if record is not None:
            known[text] = record
            records.append(record)
    if not records and not problems.found:
        said = "holds no records; add one row for each instrument file"
        problems.found.append(NoRecordsError(said, file=problems.file))
    return tuple(records)


def sheet_rows(problems: Problems) -> Sheet | None:
    """The table as text, from either file; None where there is none, and why in `problems`."""
    if (raw := problems.content()) is None:
        return None
    lines: list[Line] = []
    delimiter = ""
    workbook = problems.file.suffix == ".xlsx"
    if workbook:
        lines += (Line(*row) for row in rows_of_workbook(raw, problems))
    else:
        text, _ = decoded(raw)
        delimiter = separator_of(text)
        try:
            for line in _lines(text, delimiter):
                lines.append(line)
        except csv.Error as error:
            problems.add(
                f"cannot be read as a table ({error}); look for a quote that is not closed",
                where=f"line {lines[-1].number + 1 if lines else 1}",
            )
            return None
    if any(lines):
        return Sheet(lines, comma=delimiter != ",", workbook=workbook)
    if not problems.found:
        names = ",".join(COLUMNS)
        problems.add(f"is empty (it holds no text); its first line names the columns: {names}")
    return None


def decoded(raw: bytes) -> tuple[str, str]:
    """Text of a table, and its encoding: UTF-8, or else that of Western Windows."""
    try:
        return raw.decode("utf-8-sig"), "utf-8"
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace"), "cp1252"


def separator_of(text: str) -> str:
    """Comma, semicolon or tab, whichever parts most cells of the row that names the columns.

    Examples
    --------
    >>> separator_of("Tests, March, second rig\\nrecord;file;test\\n")
    ';'
    """
    lines = [line for line in text.splitlines() if line.strip()] or [""]
    head = next((one for one in lines if all(name in one.lower() for name in REQUIRED)), lines[0])
    return max(",;\t", key=head.count)


def column_of(head: str) -> str:
    """The column that a head means, unit in brackets or not.

    Examples
    --------
    >>> column_of("base amplitude (mm)"), column_of("frequency [Hz]"), column_of("My notes")
    ('base_amplitude_mm', 'frequency_hz', 'My notes')
    """
    plain = re.sub(r"[\s()\[\]_]+", "_", head.strip()).strip("_").lower()
    return plain if plain in COLUMNS or plain in PEOPLE else head.strip()


def _header_is_right(sheet: Sheet, problems: Problems) -> bool:
    before, header, place = len(problems.found), sheet.header, sheet.place(sheet.head.number)
    for name in header:
        if name not in COLUMNS and name not in PEOPLE and not name.startswith("x_"):
            known = nearest(name, COLUMNS)
            problems.add(f"unknown column '{name}'; {known} (notes for people: x_...)", where=place)
    for name in sorted({name for name in header if header.count(name) > 1}):
        problems.add(f"column '{name}' is there twice; remove one", where=place)
    missing = [name for name in REQUIRED if name not in header]
    if missing:
        problems.add(f"no column '{missing[0]}'; needed are {', '.join(REQUIRED)}", where=place)
    return len(problems.found) == before


def _record(
    row: dict[str, str],
    line: int,
    sheet: Sheet,
    campaign: Campaign,
    allow_outside: bool,
    problems: Problems,
) -> Record | None:
    before = len(problems.found)
    folder, settings = campaign.folder, campaign.settings
    n_masses = len(campaign.known.nes_mass)

    def cell(column: str, read: Callable[[str], T], empty: T) -> T:
        text = row.get(column, "")
        if not text:
            return empty
        with problems.at(sheet.place(line, column)):
            return read(text)
        return empty

    def required(column: str, read: Callable[[str], T]) -> T | None:
        if not row.get(column):
            problems.add("is empty; every record needs it", where=sheet.place(line, column))
        return cell(column, read, None)

    def number(text: str) -> float:
        return read_number(text, sheet.comma)

    def path(text: str) -> tuple[Path, ...]:
        return tuple(named_file(one.strip(), folder, allow_outside) for one in text.split(";"))

    files = required("file", path)
    record = Record(
        id=required("record", read_id) or "",
        file=files[0] if files else folder,
        test=required("test", lambda text: read_one_of(text, TESTS, "test")) or "",
        clearance=cell("clearance_mm", lambda text: read_clearance(text, number, n_masses), ()),
        base_amplitude=cell("base_amplitude_mm", lambda text: read_least(text, number, _MM), None),
        frequency=cell("frequency_hz", lambda text: read_frequency(text, number), None),
        added_mass=cell("added_mass_g", lambda text: read_least(text, number, "mass"), None),
        release=cell("release_mm", lambda text: read_size(text, number, _MM), None),
        exclude=cell("exclude", yes_or_no, False),
        settings=cell("settings", lambda text: changed_by_text(settings, text), settings),
        note=row.get("note", ""),
        row=line,
        more_files=files[1:] if files else (),
        setup=cell("setup", lambda text: read_one_of(text, campaign.setups, "setup"), ""),
        people={name: text for name, text in row.items() if name not in COLUMNS and text},
    )
    return record if len(problems.found) == before else None


def sheet_text(rows: Iterable[Mapping[str, str]]) -> str:
    """records.csv of such rows, each column to its cell; what a row lacks is empty.

    `setup` is a column where a row names one.

    Examples
    --------
    >>> sheet_text([{"record": "a", "file": "raw/a.csv", "note": "dropped, twice"}]).splitlines()[1]
    'a,raw/a.csv,,,,,,,,"dropped, twice"'
    """
    rows, stream = list(rows), io.StringIO()
    columns = [*SHEET_COLUMNS, *["setup"] * any(row.get("setup") for row in rows)]
    writer = csv.DictWriter(stream, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def read_number(text: str, comma: bool) -> float:
    """A number without a unit; decimal commas where `comma` allows them."""
    plain = text.strip()
    if "," in plain:
        if not comma:
            raise ParameterError(
                f"found '{text}', expected a number with a decimal point (a comma separates the "
                "columns of this table)"
            )
        plain = plain.replace(",", ".")
    if not _NUMBER.fullmatch(plain) or not math.isfinite(float(plain)):
        raise ParameterError(
            f"found '{text}', expected a number without a unit or a mark, such as 34.5; "
            "what is not known stays empty"
        )
    return float(plain)


def read_size(text: str, number: Callable[[str], float], quantity: str) -> float:
    """A length in mm or a mass in g as SI, refused where no rig has that size.

    To nine digits: 0.1 + 0.05 of a spreadsheet and a typed 0.15 are one level.

    Examples
    --------
    >>> read_size("0.15000000000000002", float, "displacement") == 0.15 / 1e3
    True
    """
    value = float(f"{number(text):.9g}") / 1e3
    refuse_impossible(text, value, quantity)
    return value


def read_least(text: str, number: Callable[[str], float], quantity: str) -> float:
    """As `read_size`, of zero or above."""
    value = read_size(text, number, quantity)
    if value < 0.0:
        raise ParameterError(f"found '{text}', expected zero or above")
    return value


def read_clearance(text: str, number: Callable[[str], float], n_masses: int) -> tuple[float, ...]:
    """Clearances in m, one for each NES."""
    values = tuple(read_size(part, number, "displacement") for part in text.split(";"))
    if any(value <= 0.0 for value in values):
        raise ParameterError(
            f"found '{text}', expected clearances above zero (empty: NES removed or blocked)"
        )
    if len(values) > MOST_BALLS:
        raise ParameterError(
            f"{len(values)} clearances; the impacts of more than {MOST_BALLS} balls cannot be "
            "distinguished; write yes under exclude, or give the clearances of the balls that "
            "matter"
        )
    if 1 < n_masses < len(values):
        raise ParameterError(
            f"{len(values)} clearances, but campaign.yaml gives {n_masses} masses under "
            "known.nes_mass; give one mass for all or one for each"
        )
    return values


def read_frequency(text: str, number: Callable[[str], float]) -> tuple[float, float]:
    """A frequency or a range, Hz."""
    parts = [number(part) for part in text.split(":")]
    if len(parts) > 2 or any(part <= 0.0 for part in parts):
        raise ParameterError(
            f"found '{text}', expected a frequency above zero or a range such as 7.2:8.4"
        )
    for part in parts:
        refuse_impossible(text, part, "frequency")
    return parts[0], parts[-1]


def read_id(text: str) -> str:
    """A name that can be a file's."""
    if not _ID.fullmatch(text) or text.endswith(".") or _RESERVED.fullmatch(text):
        raise ParameterError(
            f"found '{text}', expected a name of letters, digits and _ . + - that can be a "
            "file's name"
        )
    if len(text) > 100:
        raise ParameterError(f"the name has {len(text)} characters, expected at most 100")
    return text


def read_one_of(text: str, known: Collection[str], what: str) -> str:
    """One of the tests, or of the setups, that there are."""
    if text not in known:
        hint = nearest(text, known) if known else f"campaign.yaml has no '{what}s'"
        raise ParameterError(f"unknown {what} '{text}'; {hint}")
    return text


_MARK = b"\xef\xbb\xbf"  # of UTF-8, as spreadsheets write it


def row_of_record(sheet: Path, record: str) -> dict[str, str]:
    """The cells of a record by column; CampaignError where there is no such row."""
    found = _read(sheet)
    line = _line(found, record, sheet)
    return found.row(line.cells)


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
    found = sheet_rows(problems)
    if found is None:
        raise problems.found[0]
    return found


def _line(found: Sheet, record: str, sheet: Path) -> Line:
    for line in found.body:
        if found.row(line.cells).get("record") == record:
            return line
    raise CampaignError(f"holds no record '{record}' any more; look at the table", file=sheet)


def _write(sheet: Path, found: Sheet, line: Line | None, cells: dict[str, str]) -> None:
    content = sheet.read_bytes()
    header = list(dict.fromkeys([*found.header, *cells]))
    if found.workbook:
        row = line.number if line else found.lines[-1].number + 1
        edits = {(1, k): column for k, column in enumerate(header) if column not in found.header}
        edits |= {(row, header.index(column)): text for column, text in cells.items()}
        write_whole(sheet, edited_workbook(content, edits))
    else:
        write_whole(sheet, _changed_text(content, found, line, header, cells))


def _changed_text(
    content: bytes, found: Sheet, line: Line | None, header: list[str], cells: dict[str, str]
) -> bytes:
    """Of a CSV only the lines of the row, and the head where a column is new, are written anew."""
    text, encoding = decoded(content)
    end = "\r\n" if "\r\n" in text else "\n"
    separator = separator_of(text)
    texts = {one.number: one.text for one in found.lines}
    if header != found.header:
        titles = [*found.head.cells, *header[len(found.header) :]]
        texts[found.head.number] = _line_of(titles, separator) + end
    if line is None:
        last = found.lines[-1].number
        texts[last] = texts[last].rstrip("\r\n") + end
        line = Line(last + 1, [], end)
    row = dict(zip(header, [*line.cells, *[""] * len(header)], strict=False)) | cells
    rest = line.cells[len(header) :]
    tail = line.text[len(line.text.rstrip("\r\n")) :]
    texts[line.number] = _line_of([*row.values(), *rest], separator) + tail
    joined = "".join(texts.values()).encode(encoding)
    return _MARK + joined if content.startswith(_MARK) else joined


def _lines(text: str, separator: str) -> Iterable[Line]:
    """The text row by row; a row may go over several lines."""
    lines = list(io.StringIO(text, newline=""))
    reader = csv.reader(lines, delimiter=separator)
    done = 0
    for cells in reader:
        yield Line(done + 1, cells, "".join(lines[done : reader.line_num]))
        done = reader.line_num


def _line_of(row: list[str], separator: str) -> str:
    stream = io.StringIO()
    csv.writer(stream, delimiter=separator).writerow(row)  # ends a line as what it has to quote
    return stream.getvalue().removesuffix("\r\n")
