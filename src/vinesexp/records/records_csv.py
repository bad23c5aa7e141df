"""records.csv: one row a record, read strictly; all mistakes are collected with their line.

The table may have come out of a spreadsheet anywhere in the world: comma, semicolon or tab
between the cells, and decimal commas where the comma does not part the cells.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from vinesexp.errors import nearest
from vinesexp.records.outside import read_file
from vinesexp.records.problems import Problems
from vinesexp.records.schema import SHEET_COLUMNS, Record
from vinesexp.records.table_cells import (
    read_clearance,
    read_exclude,
    read_frequency,
    read_id,
    read_least,
    read_number,
    read_setup,
    read_size,
    read_test,
)
from vinesexp.settings.overrides import changed_by_text
from vinesexp.settings.stages import Settings

COLUMNS = (*SHEET_COLUMNS[:-1], "settings", "setup", SHEET_COLUMNS[-1])
#: Columns for people: text, carried into the records and never used in them.
PEOPLE = (
    "operator",
    "date",
    "time",
    "instrument",
    "place",
    "temperature",
    "temperature_c",
    "humidity",
    "comment",
    "notes",
)
REQUIRED = COLUMNS[:3]
_MM = "displacement"  # what the columns in mm measure
T = TypeVar("T")


def read_table(
    file: Path, folder: Path, *, allow_outside: bool, n_masses: int, problems: Problems,
    settings: Settings | None = None, setups: tuple[str, ...] = (),
) -> tuple[Record, ...]:  # fmt: skip
    """Read records.csv; what is wrong goes to `problems`, the rows that are right come back.

    Parameters
    ----------
    file, folder : Path
        records.csv and the campaign folder that its paths start from.
    allow_outside : bool
        Whether instrument files may lie outside the folder.
    n_masses : int
        How many NES masses campaign.yaml gives; more than one must suffice for every record.
    settings : Settings, optional
        Of the campaign; a row may change them.
    setups : tuple of str
        Names under `setups` in campaign.yaml.
    """
    settings = Settings() if settings is None else settings
    rows = _rows(file, problems)
    if rows is None:
        return ()
    header, comma, body = rows
    if not _header_is_right(header, problems):
        return ()
    records: list[Record] = []
    lines: dict[str, int] = {}
    for line, cells in body:
        if len(cells) > len(header) and any(cell.strip() for cell in cells[len(header) :]):
            problems.add(
                f"{len(cells)} cells under {len(header)} columns; put a cell that contains the "
                "separator in quotes",
                where=f"line {line}",
            )
            continue
        row = {name: cell.strip() for name, cell in zip(header, cells, strict=False)}
        record = _record(
            row, line, folder, comma, allow_outside, n_masses, settings, setups, problems
        )
        # Names that differ only in case would share a file on many disks.
        key = row.get("record", "").lower()
        if key and key in lines:
            problems.add(
                f"record '{row['record']}' is already in line {lines[key]}; every record needs "
                "its own name (upper and lower case count as the same)",
                where=f"line {line}, column record",
            )
        lines.setdefault(key, line)
        if record is not None:
            records.append(record)
    if not records and not problems.found:
        problems.add("holds no records; add one row for each instrument file")
    return tuple(records)


def _rows(
    file: Path, problems: Problems
) -> tuple[list[str], bool, list[tuple[int, list[str]]]] | None:
    """Header, whether decimal commas are possible, and the rows with their line numbers."""
    if file.exists() and not file.is_file():
        problems.add("is no plain file")
        return None
    try:
        raw = file.read_bytes()
    except FileNotFoundError:
        problems.add("is missing; docs/campaign.md says what it holds")
        return None
    except OSError as error:
        problems.add(f"cannot be read ({error.strerror})")
        return None
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = raw.decode("cp1252", errors="replace")
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        problems.add(f"is empty; its first line names the columns: {','.join(COLUMNS)}")
        return None
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=False)
    body: list[tuple[int, list[str]]] = []
    line = 1
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                body.append((line, cells))
            line = reader.line_num + 1
    except csv.Error as error:
        problems.add(
            f"cannot be read as a table ({error}); look for a quote that is not closed",
            where=f"line {line}",
        )
        return None
    if not body:
        problems.add(f"holds no words; its first line names the columns: {','.join(COLUMNS)}")
        return None
    header = [cell.strip() for cell in body[0][1]]
    while header and not header[-1]:
        header.pop()
    return header, delimiter != ",", body[1:]


def _header_is_right(header: list[str], problems: Problems) -> bool:
    before = len(problems.found)
    for name in header:
        if name not in COLUMNS and name not in PEOPLE and not name.startswith("x_"):
            problems.add(f"unknown column '{name}'; {nearest(name, COLUMNS)}", where="line 1")
    for name in sorted({name for name in header if header.count(name) > 1}):
        problems.add(f"column '{name}' is there twice; remove one", where="line 1")
    missing = [name for name in REQUIRED if name not in header]
    if missing:
        problems.add(f"no column '{missing[0]}'; needed are {', '.join(REQUIRED)}", where="line 1")
    return len(problems.found) == before


def _record(
    row: dict[str, str],
    line: int,
    folder: Path,
    comma: bool,
    allow_outside: bool,
    n_masses: int,
    settings: Settings,
    setups: tuple[str, ...],
    problems: Problems,
) -> Record | None:
    before = len(problems.found)

    def cell(column: str, read: Callable[[str], T], empty: T) -> T:
        text = row.get(column, "")
        if not text:
            return empty
        with problems.at(f"line {line}, column {column}"):
            return read(text)
        return empty

    def required(column: str, read: Callable[[str], T]) -> T | None:
        if not row.get(column):
            problems.add("is empty; every record needs it", where=f"line {line}, column {column}")
        return cell(column, read, None)

    def number(text: str) -> float:
        return read_number(text, comma)

    def path(text: str) -> tuple[Path, ...]:
        return tuple(read_file(one.strip(), folder, allow_outside) for one in text.split(";"))

    files = required("file", path)
    record = Record(
        id=required("record", read_id) or "",
        file=files[0] if files else folder,
        test=required("test", read_test) or "",
        clearance=cell("clearance_mm", lambda text: read_clearance(text, number, n_masses), ()),
        base_amplitude=cell("base_amplitude_mm", lambda text: read_least(text, number, _MM), None),
        frequency=cell("frequency_hz", lambda text: read_frequency(text, number), None),
        added_mass=cell("added_mass_g", lambda text: read_least(text, number, "mass"), None),
        release=cell("release_mm", lambda text: read_size(text, number, _MM), None),
        exclude=cell("exclude", read_exclude, False),
        settings=cell("settings", lambda text: changed_by_text(settings, text), settings),
        note=row.get("note", ""),
        row=line,
        more_files=files[1:] if files else (),
        setup=cell("setup", lambda text: read_setup(text, setups), ""),
        people={name: text for name, text in row.items() if name not in COLUMNS and text},
    )
    return record if len(problems.found) == before else None
