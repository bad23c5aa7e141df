"""How a text file is laid out, found from the file itself: never from the country or the name.

Encoding, delimiter, decimal sign, where the data begin, names, units. The data are found first,
as the lines that are numbers; the header is what stands above them.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

from vinesexp.errors import RecordError
from vinesexp.records.readers.labels import unit_in_name, unit_of_label
from vinesexp.records.readers.source import Column

HEAD = 1 << 17  # bytes looked at: far more than any preamble

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf)", re.IGNORECASE)
_NEWLINE = re.compile(r"\r\n|\n|\r")
_CANDIDATES = tuple((d, s) for s in ".," for d in ("\t", ";", ",", None) if d != s)


@dataclass(frozen=True)
class Layout:
    """How to read a text file.

    Parameters
    ----------
    encoding : str
        As Python names it.
    delimiter : str or None
        None: any white space.
    decimal : str
        ``"."`` or ``","``.
    first : int
        Line of the first row of data, from 0.
    columns : tuple of Column
        Those that hold data.
    preamble : tuple of tuple of str
        The cells of every line above the data.
    """

    encoding: str
    delimiter: str | None
    decimal: str
    first: int = 0
    columns: tuple[Column, ...] = ()
    preamble: tuple[tuple[str, ...], ...] = ()

    def cells(self, line: str) -> list[str]:
        """The cells of one line, without the blanks around them."""
        if self.delimiter is None:
            return line.split()
        if '"' in line:
            row = next(csv.reader([line], delimiter=self.delimiter, skipinitialspace=True), [])
            return [cell.strip() for cell in row]
        return [cell.strip() for cell in line.split(self.delimiter)]

    def is_number(self, cell: str) -> bool:
        """Whether a cell is a number in this file's decimal sign."""
        if self.decimal == ",":
            cell = cell.replace(".", "!").replace(",", ".")
        return _NUMBER.fullmatch(cell) is not None


def find_layout(path: Path) -> Layout:
    """Find the layout of a text file.

    Raises
    ------
    RecordError
        No line of numbers, or rows wider than their header.
    """
    with path.open("rb") as stream:
        raw = stream.read(HEAD)
        whole = not stream.read(1)
    text, encoding = _decode(raw)
    lines = _NEWLINE.split(text)
    if not whole and len(lines) > 1:
        lines.pop()  # cut short by the end of the head
    filled = [line for line in lines if line.strip()]
    tail = filled[-min(50, max(3, len(filled) // 2)) :]
    layout = _delimiter_and_decimal(path, tail, filled, encoding)
    return _header(path, layout, lines, tail)


def _decode(raw: bytes) -> tuple[str, str]:
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="ignore"), "utf-16"
    for cut in range(4):  # the head may end inside a character
        try:
            return raw[: len(raw) - cut].decode("utf-8-sig"), "utf-8-sig"
        except UnicodeDecodeError:
            continue
    return raw.decode("latin-1"), "latin-1"


def _delimiter_and_decimal(path: Path, tail: list[str], filled: list[str], encoding: str) -> Layout:
    """The pair under which the last lines hold most numbers and least else."""
    best, most = Layout(encoding, ",", "."), 0
    for delimiter, decimal in _CANDIDATES:
        layout = Layout(encoding, delimiter, decimal)
        score = 0
        for line in tail:
            cells = [cell for cell in layout.cells(line) if cell]
            numbers = sum(layout.is_number(cell) for cell in cells)
            score += max(0, 2 * numbers - len(cells))
        if score > most:
            best, most = layout, score
    if best.delimiter == "," and _may_be_decimal(tail):
        return _one_or_two(path, best, tail, filled)
    return best


def _may_be_decimal(tail: list[str]) -> bool:
    """Whether every line is two whole numbers, or one with a decimal comma."""
    return all(re.fullmatch(r"\s*[+-]?\d+,\d+\s*", line) for line in tail)


def _one_or_two(path: Path, layout: Layout, tail: list[str], filled: list[str]) -> Layout:
    """Whether ``18,905`` is one number or two: the names above tell, or zeros as in ``0,031``."""
    one = replace(layout, delimiter=None, decimal=",")
    names = next((line for line in filled if re.search("[A-Za-z]", line)), None)
    if names is not None:
        return layout if "," in names else one
    if any(re.search(r",0\d", line) for line in filled):
        return one
    raise RecordError(
        f"'{tail[-1].strip()}' is one number with a decimal comma or two whole ones; write the "
        "names of the columns into the first line",
        file=path,
    )


def _header(path: Path, layout: Layout, lines: list[str], tail: list[str]) -> Layout:
    rows = [layout.cells(line) if line.strip() else [] for line in lines]
    numeric = _numeric_columns(layout, tail)
    if not numeric:
        raise RecordError(
            "no line of numbers found; export the record as columns of numbers", file=path
        )

    def is_data(cells: list[str]) -> bool:
        kinds = [layout.is_number(cell) for cell in cells]
        inside = [(j, c) for j, c in enumerate(cells) if c and (j in numeric or j < min(numeric))]
        return bool(inside) and all(kinds[j] and j in numeric for j, _ in inside)

    filled = [i for i, cells in enumerate(rows) if any(cells)]
    pairs = zip(filled, [*filled[1:], None], strict=True)
    first = next(
        (i for i, after in pairs if is_data(rows[i]) and (after is None or is_data(rows[after]))),
        None,
    )
    if first is None:
        raise RecordError(
            "no line of numbers found; export the record as columns of numbers", file=path
        )
    above = [i for i in filled if i < first]
    names, units = [], []
    while above and _is_text(rows[above[-1]], numeric, layout) is False:
        # A row with numbers under the names is data with a bad cell: read, and then told.
        if not any(_is_text(rows[i], numeric, layout) for i in above):
            break
        first = above.pop()
    if above and _is_text(rows[above[-1]], numeric, layout):
        names = rows[above[-1]]
        if len(above) > 1 and _is_text(rows[above[-2]], numeric, layout) and _are_units(names):
            units, names = names, rows[above[-2]]
    names = [re.sub(r"^(#|%|//)\s*", "", name) for name in names]
    width = max(numeric) + 1
    last_name = max((j for j, name in enumerate(names) if name), default=-1)
    if names and width > last_name + 1:
        raise RecordError(
            f"{width} cells under {last_name + 1} names; if the numbers have decimal commas, "
            "export with another delimiter",
            file=path,
            where=f"line {first + 1}",
        )
    return replace(
        layout,
        first=first,
        columns=tuple(_column(j, names, units) for j in range(width)),
        preamble=tuple(tuple(cells) for cells in rows[:first]),
    )


def _numeric_columns(layout: Layout, tail: list[str]) -> set[int]:
    """Columns that are numbers in most of the last lines, up to the first line of few numbers."""
    numbers: Counter[int] = Counter()
    others: Counter[int] = Counter()
    for line in reversed(tail):
        filled = [(j, cell) for j, cell in enumerate(layout.cells(line)) if cell]
        right = [j for j, cell in filled if layout.is_number(cell)]
        if 2 * len(right) < len(filled) and numbers:
            break
        numbers.update(right)
        others.update({j for j, _ in filled} - set(right))
    return {j for j, count in numbers.items() if count > others[j]}


def _is_text(cells: list[str], numeric: set[int], layout: Layout) -> bool | None:
    """True for a row of names, False for a row with numbers among them, None for another line."""
    inside = [cells[j] for j in numeric if j < len(cells) and cells[j]]
    if 2 * len(inside) < len(numeric) or len(inside) < min(2, len(numeric)):
        return None
    return not any(layout.is_number(cell) for cell in inside)


def _are_units(cells: list[str]) -> bool:
    words = [cell for cell in cells if cell and not _NUMBER.fullmatch(cell)]
    bracketed = [re.fullmatch(r"[(\[].*[)\]]", word) is not None for word in words]
    return all(b or unit_of_label(w) for b, w in zip(bracketed, words, strict=True))


def _column(j: int, names: list[str], units: list[str]) -> Column:
    name = names[j] if j < len(names) else ""
    unit = units[j] if j < len(units) else ""
    return Column(name, unit_of_label(unit) or unit.strip("()[] ") or unit_in_name(name))
