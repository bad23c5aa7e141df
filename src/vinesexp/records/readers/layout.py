"""How a text file is laid out, found from the file itself: never from the country or the name.

Encoding, delimiter, decimal sign, where the data begin. The data are found first, as the lines
that are numbers; what stands above them is read by `header`.

Dates and times of day in the cells of data loggers, as seconds since the first of them.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import cache
from itertools import chain, pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vinesexp.errors import ParameterError, RecordError
from vinesexp.records.readers.labels import is_overload
from vinesexp.records.readers.source import WIDEST, Column

HEAD = 1 << 17  # bytes looked at: far more than any preamble
_TAIL = 1 << 15  # the same of what stands behind the data
_NO_NUMBERS = "no row of numbers found; export the record as columns of numbers"
_NEAR = 50  # rows whose form the last one should have
_EXPONENT = r"(?:[eEdD][+-]?\d+)?"  # Fortran writes 1.0D-03
_NUMBER = re.compile(rf"[+-]?(?:\d+\.?\d*|\.\d+){_EXPONENT}|[+-]?(?:nan|inf)", re.IGNORECASE)
#: `1,234.5`, `1'234.5`, `1 234.5`, `1,234,567`; and `1,234`, which may be a decimal comma.
_GROUPED = re.compile(
    rf"[+-]?[1-9]\d{{0,2}}([,'’ \xa0\u202f])\d{{3}}(?:\1\d{{3}})*(\.\d*)?{_EXPONENT}"
)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+")
_SWAPPED = str.maketrans(",.", ".,")
_MARKS = ("#", "%", "//")  # of comment
_FEWEST_HALVES = 2  # lines
_FEWEST_GROUPED = 5  # cells; below, a point is a decimal point
#: Delimiters, None for white space, with each decimal sign.
CANDIDATES = tuple((d, s) for s in ".," for d in ("\t", ";", ",", None) if d != s)
_CLOCK = r"(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2})(?:[.,:](?P<f>\d{1,9}))?)?"
_ZONE = r"(?:\s*(?:Z|UTC|[+-]\d{2}:?\d{2}))?"
_TICKS = 10**9  # a second: a clock has nine digits
_HALF = r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"

_DATES = (
    r"(?P<n>\d+) days?,?",  # pandas writes durations so
    r"(?P<Y>\d{4})[-/.](?P<M>\d{1,2})[-/.](?P<D>\d{1,2})",
    r"(?P<a>\d{1,2})[-/.](?P<b>\d{1,2})[-/.](?P<Y>\d{4}|\d{2})",
)

_STAMPS = tuple(
    re.compile(rf"(?:{date}[T\s]+)?{_CLOCK}{_HALF}{_ZONE}", re.ASCII) for date in _DATES
)


@dataclass(frozen=True)
class Lines:
    """How a line of a text is called in the file that the text is from.

    Parameters
    ----------
    word : str
    of : str
        Part of the file that it is in.
    shift : int
        Its number in the file less that in the text.

    Examples
    --------
    >>> Lines().at(12), Lines("row", of="sheet 'Run 2'", shift=1).at(12)
    ('line 12', "sheet 'Run 2', row 13")
    """

    word: str = "line"
    of: str = ""
    shift: int = 0

    def at(self, number: int) -> str:
        """Where line `number` (from 1) of the text is."""
        return f"{self.of}{', ' if self.of else ''}{self.word} {number + self.shift}"


#: A text that is the whole file.
THE_FILE = Lines()


@dataclass(frozen=True)
class Stated:
    """What a preamble states; None and empty where it does not.

    Attributes
    ----------
    interval, start, rows : float or None, float, int or None
        Sample interval, time of the first row (s) and number of rows.
    names, units : list of str
        In the order of the columns; units are empty where a column has none.
    time_unit : str or None
    """

    interval: float | None = None
    start: float = 0.0
    rows: int | None = None
    names: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    time_unit: str | None = None


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
    time_column : int or None
        The only one that has a unit of time.
    stated : Stated
        What stands above the rows.
    stamps : tuple of int
        Columns of dates or times of day.
    width : int
        Cells that a row of data may have at most.
    unpaired : str
        Why the names cannot be paired with the columns; empty where they are.
    behind : tuple of str
        Lines after the last row that are no data: what programs write when they end.
    end : int
        Bytes of the file up to them; 0 where there are none.
    cut : bool
        Whether what stands behind is the beginning of one more row.
    grouped : bool
        Whether `1,234` (with a decimal point) or `1.234` (with a comma) is a thousand and more.
    held : int
        Columns that hold numbers or stamps.
    """

    encoding: str
    delimiter: str | None
    decimal: str
    first: int = 0
    columns: tuple[Column, ...] = ()
    time_column: int | None = None
    stated: Stated = field(default_factory=Stated)
    stamps: tuple[int, ...] = ()
    width: int = 0
    unpaired: str = ""
    behind: tuple[str, ...] = ()
    end: int = 0
    cut: bool = False
    grouped: bool = False
    held: int = 0

    def cells(self, line: str) -> list[str]:
        """The cells of one line, without the blanks around them."""
        if self.delimiter is None:
            return line.split()
        if '"' in line:
            with suppress(csv.Error):  # lone returns inside, or a quote that swallows all
                row = next(csv.reader([line], delimiter=self.delimiter, skipinitialspace=True), [])
                return [cell.strip() for cell in row]
        return list(map(str.strip, line.split(self.delimiter)))

    def is_number(self, cell: str) -> bool:
        """Whether a cell is a number in this file's decimal sign."""
        return self.number(cell) is not None

    def number(self, cell: str) -> str | None:
        """A number as Python writes it, or None.

        Examples
        --------
        >>> Layout("utf-8", ";", ",").number("1.234,5"), Layout("utf-8", ";", ".").number("1D-03")
        ('1234.5', '1e-03')
        >>> Layout("utf-8", ";", ".").number("1,234") is None
        True
        """
        if self.decimal == ",":
            cell = cell.translate(_SWAPPED)
        if not _NUMBER.fullmatch(cell):
            match = _GROUPED.fullmatch(cell)
            sure = match and (match[1] != "," or match[2] or cell.count(",") > 1)
            if not match or not (sure or self.grouped):
                return None
            cell = re.sub(r"[,'’\s]", "", cell)
        return cell.replace("D", "e").replace("d", "e")

    def is_value(self, cell: str) -> bool:
        """Whether a cell is a number, or the word an instrument writes for one out of range."""
        return self.is_number(cell) or is_overload(cell)


@dataclass(frozen=True)
class Body:
    """Where the data of a text file are.

    Parameters
    ----------
    lines : list of str
        The head of the file.
    row : function
        The cells of one of them, none of a blank line.
    first : int
        Line of the first row of data.
    numeric : set of int
        Columns of numbers.
    stamps : set of int
        Columns of dates or times of day.
    """

    lines: list[str]
    row: Callable[[int], list[str]]
    first: int
    numeric: set[int]
    stamps: set[int]

    @property
    def width(self) -> int:
        """Columns, from the first to the last that holds data."""
        return max(self.numeric | self.stamps) + 1


def find_body(path: Path) -> tuple[Layout, Body]:
    """Find encoding, delimiter, decimal sign and the data of a text file.

    Raises
    ------
    RecordError
        No row of numbers.
    """
    with path.open("rb") as stream:
        raw = stream.read(HEAD)
        whole = not stream.read(1)
    text, encoding = _decode(raw)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    filled = [i for i, line in enumerate(lines) if line.strip()]
    if not filled:
        raise RecordError(_NO_NUMBERS)
    step = max(len(filled) // 100, 1)  # lines all over: many may stand behind the last row
    last = filled[-min(50 * step, max(3, len(filled) // 2)) :: step]
    tail = [lines[i] for i in last]
    layout = _delimiter_and_decimal(tail, [lines[i] for i in filled], encoding)
    numeric, stamps = _columns_of_data(layout, tail)
    if not numeric or max(numeric) >= WIDEST:
        raise RecordError(_NO_NUMBERS)
    behind, end, cut = _behind(path, layout, numeric, stamps)
    if whole and behind:
        lines = lines[: filled[-len(behind)]]
    layout = replace(layout, behind=tuple(behind), end=end, cut=cut)
    return layout, _body(layout, lines, numeric, stamps)


def _behind(
    path: Path, layout: Layout, numeric: set[int], stamps: set[int]
) -> tuple[list[str], int, bool]:
    """Lines after the last row of data, the byte at which they begin, and whether a cut row is it.

    Where no line at the end is a row, words belong to the rows. A row is cut where no line end
    closes it, and it has fewer cells than any of the rows above, or its last number fewer decimals
    than in any of them.
    """
    size = path.stat().st_size
    with path.open("rb") as stream:
        stream.seek(max(size - _TAIL, 0))
        raw = stream.read().splitlines(keepends=True)
    texts = [line.decode(layout.encoding, "replace").strip() for line in raw]
    backward = reversed([k for k, text in enumerate(texts) if text])
    row = next((k for k in backward if _is_row(layout, numeric, stamps, texts[k])), len(raw))
    after = row + 1
    found = [text for text in texts[after:] if text]
    if any("\0" in text for text in found):  # what a logger leaves that lost its power is no footer
        return [], 0, False
    if found:
        return found, size - len(b"".join(raw[after:])), False
    above = [_shape(layout, text) for text in texts[size > _TAIL : -1][-_NEAR:] if text]
    if raw[-1].endswith((b"\n", b"\r")) or len(above) < 3:
        return [], 0, False
    cells, decimals = _shape(layout, texts[-1])
    fewest = min(count for count, _ in above)
    least = min(digits for count, digits in above if count == fewest)
    if cells > fewest or (cells == fewest and decimals >= least):
        return [], 0, False
    return [texts[-1]], size - len(raw[-1]), True


def _shape(layout: Layout, line: str) -> tuple[int, int]:
    """How many cells a line has, and how many characters follow the decimal sign of the last.

    Examples
    --------
    >>> _shape(Layout("utf-8", ";", ","), "0,25;-1,5e-03"), _shape(Layout("utf-8", ";", ","), "1")
    ((2, 5), (1, 0))
    """
    cells = layout.cells(line)
    return len(cells), len(cells[-1].partition(layout.decimal)[2]) if cells else 0


def is_remark(layout: Layout, line: str) -> bool:
    """Whether a line among the rows begins with a mark of comment and holds no value.

    Examples
    --------
    >>> table = Layout("utf-8", ";", ".")
    >>> is_remark(table, "# buffer; flushed"), is_remark(table, "# 1; 2")
    (True, False)
    """
    if not line.lstrip().startswith(_MARKS):
        return False
    return not any(layout.is_value(cell) for cell in layout.cells(line))


def _is_row(layout: Layout, numeric: set[int], stamps: set[int], line: str) -> bool:
    """Whether most of a line's cells are values, that in the first column of data among them.

    A word, a date or a time of day where the rows have a number begins no row: ``Mean,0.01,3.2``.
    """
    cells = layout.cells(line)
    first = min(numeric | stamps, default=0)
    begun = first in stamps or not cells[first : first + 1] or not cells[first]
    filled = [cell for cell in cells if cell]
    values = sum(layout.is_value(cell) or is_stamp(cell) for cell in filled)
    words = line.startswith(_MARKS)
    return not words and 2 * values > len(filled) and (begun or layout.is_value(cells[first]))


def _decode(raw: bytes) -> tuple[str, str]:
    with suppress(UnicodeDecodeError):  # the head may end inside a character
        return codecs.getincrementaldecoder("utf-8-sig")().decode(raw), "utf-8-sig"
    return raw.decode("latin-1"), "latin-1"


def _delimiter_and_decimal(tail: list[str], filled: list[str], encoding: str) -> Layout:
    """The pair under which the last lines hold most numbers and least else."""
    best, most = Layout(encoding, ",", "."), 0
    for delimiter, decimal in CANDIDATES:
        layout = Layout(encoding, delimiter, decimal)
        score = 0
        for line in tail:
            cells = [cell for cell in layout.cells(line) if cell]
            numbers = sum(layout.is_value(cell) for cell in cells)
            others = sum(not is_stamp(cell) for cell in cells) - numbers
            score += max(0, numbers - others)
        if score > most:
            best, most = layout, score
    return (
        _with_commas(best, tail, filled)
        if best.delimiter == ","
        else _with_thousands(best, [*filled, *tail])
    )


def _with_commas(layout: Layout, tail: list[str], filled: list[str]) -> Layout:
    """Refuse commas that stand both within numbers and between them, or may do either.

    Whether ``18,905`` is one number or two: the names above decide, or zeros as in ``0,031``.
    """
    names = next((line for line in filled if re.search("[A-Za-z]", line)), None)
    if all(re.fullmatch(r"\s*[+-]?\d+,\d+\s*", line) for line in tail):
        if names is not None and "," in names:
            return layout
        if names is not None or any(re.search(r",0\d", line) for line in filled):
            return replace(layout, delimiter=None, decimal=",")
    elif sum(map(_halves, [*filled[:_NEAR], *tail])) <= _FEWEST_HALVES:
        return layout
    raise RecordError(
        f"'{tail[-1].strip()[:60]}' has commas in its numbers or between them; export with another "
        "delimiter, or write the names of the columns into the first line"
    )


def _with_thousands(layout: Layout, lines: list[str]) -> Layout:
    """Whether the decimal sign found only divides thousands: ``2,089`` in a column with ``89``.

    A number of three decimals stands among others of three; one of as many as it needs, among
    others of one and two.
    """
    sign = layout.decimal
    columns: dict[int, list[str]] = {}
    for line in lines:
        for j, cell in enumerate(layout.cells(line)):
            if sign in cell or cell.lstrip("+-").isdecimal():
                columns.setdefault(j, []).append(cell.replace(sign, ","))
    signed = [cell for cells in columns.values() for cell in cells if "," in cell]
    mixed = any(
        any("," in cell for cell in cells) and any("," not in cell for cell in cells)
        for cells in columns.values()
    )
    several = any(cell.count(",") > 1 for cell in signed)
    fewest = 1 if sign == "," else _FEWEST_GROUPED
    if len(signed) < fewest or not (mixed or several) or not all(map(_THOUSANDS.fullmatch, signed)):
        return layout
    return replace(layout, decimal="," if sign == "." else ".", grouped=True)


def _halves(line: str) -> bool:
    """Whether a comma stands within a number: what follows begins with a zero, or `x:0` is before.

    Examples
    --------
    >>> _halves("0,1,0,031"), _halves("x:0,12 y:0,3"), _halves("1,0,31"), _halves("x:0.1,12")
    (True, True, False, False)
    """
    halves = r"\d,0\d\d+(?:,|\s*$)|[A-Za-z]\s*[:=]\s*[+-]?\d+,\d"
    return "." not in line and re.search(halves, line) is not None


def _body(layout: Layout, lines: list[str], numeric: set[int], stamps: set[int]) -> Body:
    @cache  # most lines need no look: the first rows of data are found early
    def row(i: int) -> list[str]:
        return layout.cells(lines[i]) if lines[i].strip() else []

    # An oscilloscope may write its settings into the first columns, beside the data.
    beside = min(numeric | stamps) >= 2

    def is_data(cells: list[str], beside: bool) -> bool:
        inside = [
            (j, c)
            for j, c in enumerate(cells)
            if c and (j in numeric or (j < min(numeric) and not beside))
        ]
        return bool(inside) and all(
            layout.is_value(c) if j in numeric else (j in stamps and is_stamp(c)) for j, c in inside
        )

    def first_row(beside: bool) -> int | None:
        fits = cache(lambda i: i is None or is_data(row(i), beside))
        filled = chain((i for i in range(len(lines)) if any(row(i))), [None])
        return next((i for i, after in pairwise(filled) if fits(i) and fits(after)), None)

    first = first_row(beside)
    if first is None and not beside:
        first = first_row(True)  # or words stand before the numbers of every row
    if first is None:
        raise RecordError(_NO_NUMBERS)
    # pandas numbers the columns that have no names, over an index without one: `,0,1`.
    if row(first)[:1] == [""] and row(first)[1:] == [*map(str, range(len(row(first)) - 1))]:
        first += 1
    # A column that ends before the last rows holds data where most of the first rows fill it.
    width, near = max(numeric | stamps) + 1, range(first, min(first + _NEAR, len(lines)))
    wide = [lines[i] for i in near if any(row(i)[width:])]
    if 2 * len(wide) > len(near):
        more = _columns_of_data(layout, wide)
        numeric |= {j for j in more[0] if j >= width}
        stamps |= {j for j in more[1] if j >= width}
    return Body(lines, row, first, numeric, stamps)


def _columns_of_data(layout: Layout, tail: list[str]) -> tuple[set[int], set[int]]:
    """Columns that are numbers, or stamps, in most of the last lines.

    Lines are looked at from the last one up to the first of few numbers.
    """
    numbers: Counter[int] = Counter()
    stamps: Counter[int] = Counter()
    others: Counter[int] = Counter()
    for line in reversed(tail):
        filled = [(j, cell) for j, cell in enumerate(layout.cells(line)) if cell]
        right = {j for j, cell in filled if layout.is_value(cell)}
        dated = {j for j, cell in filled if j not in right and is_stamp(cell)}
        if 2 * len(right | dated) < len(filled) and numbers:
            break
        numbers.update(right)
        stamps.update(dated)
        others.update({j for j, _ in filled} - right - dated)
    numeric = {j for j, count in numbers.items() if count > others[j] + stamps[j]}
    return numeric, {j for j, count in stamps.items() if count > others[j] + numbers[j]}


def is_stamp(cell: str) -> bool:
    """Whether a cell is a time of day, with a date or without.

    Examples
    --------
    >>> is_stamp("2024-03-05 12:00:00.001"), is_stamp("12:00:00,5"), is_stamp("2024")
    (True, True, False)
    """
    return ":" in cell and any(form.fullmatch(cell) for form in _STAMPS)


def seconds_since(cells: Sequence[str], first: str) -> NDArray[np.float64]:
    """Seconds from the stamp `first` to each of `cells`; NaN where a cell is empty.

    Raises
    ------
    ParameterError
        A cell that is no stamp.

    Examples
    --------
    >>> seconds_since(["05.03.2024 00:00:00,25"], "04.03.2024 23:59:59,75")
    array([0.5])
    """
    day_first = _day_first([first, *cells[-1:]])
    origin = _ticks(first, day_first)
    texts = map(str.strip, cells)
    # Whole ticks: a difference of printed times is a printed time, to its last digit.
    since = (_ticks(text, day_first) - origin if text else np.nan for text in texts)
    return np.array([ticks / _TICKS for ticks in since], dtype=np.float64)


def _day_first(cells: Sequence[str]) -> bool:
    """Whether ``05/03/2024`` is the fifth of March: a first part above 12 decides, else a point."""
    for cell in cells:
        match = _STAMPS[-1].fullmatch(cell.strip())
        if match and match["a"] and (int(match["a"]) > 12 or int(match["b"]) > 12):
            return int(match["a"]) > 12
    return bool(cells) and "/" not in cells[0]


def _ticks(cell: str, day_first: bool) -> int:
    """A stamp in ticks, from midnight where it has neither a date nor a count of days."""
    match = next((m for form in _STAMPS if (m := form.fullmatch(cell))), None)
    if match is None:
        raise ParameterError(f"found '{cell[:40]}', expected a date and time as in the first row")
    found = match.groupdict()
    hour = int(found["h"])
    if found["half"]:
        hour = hour % 12 + (12 if found["half"] in "pP" else 0)
    second = hour * 3600 + int(found["m"]) * 60 + int(found["s"] or 0)
    ticks = second * _TICKS + int(f"{found['f'] or '':0<9}")
    if not found.get("Y"):
        return int(found.get("n") or 0) * 86400 * _TICKS + ticks
    if "a" in found:
        month, day = (found["b"], found["a"]) if day_first else (found["a"], found["b"])
    else:
        month, day = found["M"], found["D"]
    year = int(found["Y"]) + (2000 if len(found["Y"]) == 2 else 0)
    try:
        return datetime(year, int(month), int(day)).toordinal() * 86400 * _TICKS + ticks
    except ValueError:
        raise ParameterError(f"found '{cell[:40]}', which is not a date") from None
