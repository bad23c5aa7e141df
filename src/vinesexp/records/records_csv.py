"""records.csv: one row a record, read strictly; all mistakes are collected with their line.

The table may have come out of a spreadsheet anywhere in the world: comma, semicolon or tab
between the cells, and decimal commas where the comma does not part the cells.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from vinesexp.errors import ParameterError, nearest
from vinesexp.records.problems import Problems
from vinesexp.records.schema import TESTS, Record
from vinesexp.settings.overrides import changed_by_text
from vinesexp.settings.stages import Settings

COLUMNS = (
    "record",
    "file",
    "test",
    "clearance_mm",
    "base_amplitude_mm",
    "frequency_hz",
    "added_mass_g",
    "release_mm",
    "exclude",
    "settings",
    "note",
)
REQUIRED = COLUMNS[:3]
_ID = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)  # Windows devices
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_YES = {"": False, "no": False, "n": False, "false": False, "0": False}
_YES |= {"yes": True, "y": True, "true": True, "1": True}
T = TypeVar("T")


def read_table(
    file: Path, folder: Path, *, allow_outside: bool, n_masses: int, problems: Problems,
    settings: Settings | None = None,
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
        record = _record(row, line, folder, comma, allow_outside, n_masses, settings, problems)
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
    for cells in reader:
        if any(cell.strip() for cell in cells):
            body.append((line, cells))
        line = reader.line_num + 1
    header = [cell.strip() for cell in body[0][1]]
    while header and not header[-1]:
        header.pop()
    return header, delimiter != ",", body[1:]


def _header_is_right(header: list[str], problems: Problems) -> bool:
    before = len(problems.found)
    for name in header:
        if name not in COLUMNS:
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
        return _number(text, comma)

    record = Record(
        id=required("record", _id) or "",
        file=required("file", lambda text: _file(text, folder, allow_outside)) or folder,
        test=required("test", _test) or "",
        clearance=cell("clearance_mm", lambda text: _clearance(text, number, n_masses), ()),
        base_amplitude=cell("base_amplitude_mm", lambda text: _least(text, number) / 1e3, None),
        frequency=cell("frequency_hz", lambda text: _frequency(text, number), None),
        added_mass=cell("added_mass_g", lambda text: _least(text, number) / 1e3, None),
        release=cell("release_mm", lambda text: number(text) / 1e3, None),
        exclude=cell("exclude", _exclude, False),
        settings=cell("settings", lambda text: changed_by_text(settings, text), settings),
        note=row.get("note", ""),
        row=line,
    )
    return record if len(problems.found) == before else None


def _number(text: str, comma: bool) -> float:
    plain = text.strip()
    if "," in plain:
        if not comma:
            raise ParameterError(
                f"found '{text}', expected a number with a decimal point (a comma parts the "
                "columns of this table)"
            )
        plain = plain.replace(",", ".")
    if not _NUMBER.fullmatch(plain) or not math.isfinite(float(plain)):
        raise ParameterError(f"found '{text}', expected a number without a unit")
    return float(plain)


def _least(text: str, number: Callable[[str], float]) -> float:
    value = number(text)
    if value < 0.0:
        raise ParameterError(f"found '{text}', expected zero or above")
    return value


def _clearance(text: str, number: Callable[[str], float], n_masses: int) -> tuple[float, ...]:
    values = tuple(number(part) for part in text.split(";"))
    if any(value <= 0.0 for value in values):
        raise ParameterError(
            f"found '{text}', expected clearances above zero (empty: NES removed or blocked)"
        )
    if 1 < n_masses < len(values):
        raise ParameterError(
            f"{len(values)} clearances, but campaign.yaml gives {n_masses} masses under "
            "known.nes_mass; give one mass for all or one for each"
        )
    return tuple(value / 1e3 for value in values)


def _frequency(text: str, number: Callable[[str], float]) -> tuple[float, float]:
    parts = [number(part) for part in text.split(":")]
    if len(parts) > 2 or any(part <= 0.0 for part in parts):
        raise ParameterError(
            f"found '{text}', expected a frequency above zero or a range such as 7.2:8.4"
        )
    return parts[0], parts[-1]


def _id(text: str) -> str:
    if not _ID.fullmatch(text) or text.endswith(".") or _RESERVED.fullmatch(text):
        raise ParameterError(
            f"found '{text}', expected a name of letters, digits and _ . + - that can be a "
            "file's name"
        )
    if len(text) > 100:
        raise ParameterError(f"the name has {len(text)} characters, expected at most 100")
    return text


def _test(text: str) -> str:
    if text not in TESTS:
        close = nearest(text, TESTS)
        raise ParameterError(f"unknown test '{text}'; {close}")
    return text


def _exclude(text: str) -> bool:
    answer = _YES.get(text.lower())
    if answer is None:
        raise ParameterError(f"found '{text}', expected yes or no (the reason goes to note)")
    return answer


def _file(text: str, folder: Path, allow_outside: bool) -> Path:
    path = folder / text
    # Links are followed: what counts is where the file is, not how it is written.
    if not allow_outside and not path.resolve().is_relative_to(folder.resolve()):
        raise ParameterError(
            f"'{text}' leaves the campaign folder; move the file into it, or write "
            "'allow_outside: yes' in campaign.yaml"
        )
    return path
