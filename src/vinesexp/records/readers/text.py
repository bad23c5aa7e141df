"""Text files of oscilloscopes, analysers and data loggers: CSV of any kind, plain columns.

What is no plain table is laid aside as one first: UTF-16, rows of one channel each, rows with
words around their numbers, rows with lines behind them, and one of several blocks of rows. LabVIEW
writes a file of several segments so, and programs that append record to record. What stands above
the first block belongs to all of them, but for what a block states itself.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from io import StringIO
from itertools import islice, pairwise
from pathlib import Path
from typing import IO

import numpy as np

from vinesexp.arrays import FloatArray, runs_of
from vinesexp.errors import ParameterError, RecordError
from vinesexp.records.readers.header import find_layout
from vinesexp.records.readers.labels import CODED, CODES, is_overload, overload_value, unit_of_label
from vinesexp.records.readers.layout import (
    CANDIDATES,
    THE_FILE,
    Layout,
    Lines,
    is_remark,
    seconds_since,
)
from vinesexp.records.readers.source import (
    BLOCK_ROWS,
    Source,
    file_aside,
    file_of,
    number_of_part,
    numbered,
    part_of,
)
from vinesexp.units import counted

NAME = "text (CSV, TXT, LabVIEW LVM)"

#: What stands for a missing sample; every other word in a cell is a mistake.
_MISSING = ["", "NaN", "nan", "NAN", "-NaN", "-nan"]
_FEWEST = 3  # rows of a block; what follows fewer is a remark
_MOST = 0.2  # stretches of words for each row: more are rows with text in them
_LISTED = 1 << 20  # lines of words: likewise
_WORDS = frozenset('ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz#*%"[')
_CHUNK = 1 << 22
_ACROSS = 50  # samples at least of a channel that lies in a row
_LONGEST = 1 << 24  # bytes of a file of such rows, which is in memory at once
_SIGNS = [Layout("utf-8", delimiter, decimal) for delimiter, decimal in CANDIDATES]
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")  # the mark that such a file begins with


def recognises(head: bytes, suffix: str) -> bool:
    """Text has no zero bytes, unless it is UTF-16, which begins with its mark."""
    return head[:2] in _UTF_16 or b"\0" not in head.rstrip(b"\0")


def open_file(path: Path) -> TextSource:
    """Open a text file, or one of its blocks; RecordError where it holds no columns of numbers."""
    text, aside = file_of(path), None
    with text.open("rb") as stream:
        wide = stream.read(2) in _UTF_16
    if wide:
        aside, text = _narrow(text)
    if (columns := turned(text)) is not None:
        return TextSource(path, *columns)
    try:
        layout = find_layout(text)
        bare = not layout.unpaired and not any(column.name for column in layout.columns)
    except RecordError:
        if (found := _without_words(text, 0)) is None:
            raise
        return TextSource(path, *found)
    # Without names above, words in the rows may be the names, and glued to their numbers.
    if bare and (found := _without_words(text, layout.held)) is not None:
        return TextSource(path, *found)
    if blocks := find_blocks(text, layout):
        block = blocks[number_of_part(path, len(blocks), "blocks of rows")]
        source = TextSource(path, *laid_aside(lines_of_block(text, layout, block)))
        source.called = Lines(shift=block[1] - source.layout.first)
        source.parts = numbered(len(blocks))
        return source
    if part_of(path):
        raise RecordError("holds one block of rows; leave out the # and what follows it")
    return TextSource(path, aside, text, layout=layout)


def laid_aside(pieces: Iterable[str | bytes]) -> tuple[IO[bytes], Path]:
    """A file of these pieces, gone when it is closed, and where this process can open it."""
    aside, text = file_aside()
    for one in pieces:
        aside.write(one.encode("utf-8", "replace") if isinstance(one, str) else one)
    aside.flush()
    return aside, text


def turned(file: Path) -> tuple[IO[bytes], Path, Lines] | None:
    """Rows of one channel each laid aside as columns; None where each row is a sample.

    As in an array, samples are along the longer side. The first cell of a row may be its name.
    """
    with file.open(encoding="utf-8-sig", errors="replace") as stream:
        line = stream.readline(_LONGEST)
        layout = next((one for one in _SIGNS if len(_row_of_values(one, line)) >= _ACROSS), None)
        if layout is None or not file.stat().st_size <= min(len(line) ** 2, _LONGEST):
            return None
        rows = [_row_of_values(layout, one) for one in (line, *stream) if one.strip()]
    if len({len(row) for row in rows}) > 1 or len(rows) >= len(rows[0]):
        return None
    sign = layout.delimiter or "\t"
    columns = laid_aside(f"{sign.join(cells)}\n" for cells in zip(*rows, strict=True))
    return *columns, Lines("cell")


def _row_of_values(layout: Layout, line: str) -> list[str]:
    """The cells of a line of which all but the first are values; else none."""
    cells = layout.cells(line.rstrip().rstrip(layout.delimiter))
    return cells if all(map(layout.is_value, cells[1:])) else []


def _narrow(file: Path) -> tuple[IO[bytes], Path]:
    """UTF-16 laid aside as UTF-8, of which a line end is one byte and a delimiter another."""
    with file.open(encoding="utf-16", errors="replace", newline="") as stream:
        return laid_aside(iter(lambda: stream.read(_CHUNK), ""))


_FIGURE = re.compile(
    r"(?<![\w.^])(?<!\d[:/-])(?:(?:\d{4}-\d\d-\d\d[T ])?\d{1,2}:\d\d:\d\d(?:[.,]\d+)?Z?"
    r"|[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?)(?![\d:/]|\.\d)"
)
_ALIKE = 10  # rows of one form at least


def _without_words(file: Path, least: int) -> tuple[IO[bytes], Path, Lines] | None:
    """Rows with the same words around their numbers laid aside as columns with names and units.

    ``x:0.12 y:0.3``, ``{"t": 0.1, "x": 2}``, ``(0.1, 2)``, ``0.1 s, 2 mm``. None where most rows
    are not alike, or have no more numbers than `least`. Lines of another form are kept: words among
    the numbers are refused when they are read.
    """
    with file.open(encoding="utf-8", errors="replace") as stream:
        head = Counter(_form(line) for line in islice(stream, 200) if line.strip())
    form, count = max(head.items(), key=lambda item: item[1], default=((), 0))
    alike = count >= _ALIKE and 2 * count > head.total() and len(form) - 1 > least
    names = _names_of_form(form) if alike else None
    if names is None:
        return None
    with file.open(encoding="utf-8", errors="replace") as stream:
        return *laid_aside(_as_columns(stream, form, names)), Lines(shift=-int(any(names)))


def _as_columns(lines: Iterable[str], form: tuple[str, ...], names: list[str]) -> Iterator[str]:
    """Lines of a form by their numbers, below the names if there are any; others as they are."""
    named = not any(names)
    for line in lines:
        if _form(line) == form:
            if not named:
                yield "\t".join(names) + "\n"
            line, named = "\t".join(_FIGURE.findall(line)) + "\n", True
        yield line


def _form(line: str) -> tuple[str, ...]:
    """What stands before, between and behind the numbers of a line."""
    pieces = _FIGURE.split(line.strip())
    # A comma with a blank divides numbers; one without may be a decimal comma, unless points are.
    plain = any("." in figure and ":" not in figure for figure in _FIGURE.findall(line))
    return tuple(
        words if words == "," and not plain else " ".join(words.split()) + " " for words in pieces
    )


def _names_of_form(form: tuple[str, ...]) -> list[str] | None:
    """Names with units of the numbers of such rows; None where the words are neither.

    Examples
    --------
    >>> _names_of_form(("x:", "mm y:", "mm")), _names_of_form(('{"t":', ',"x":', "}"))
    (['x (mm)', 'y (mm)'], ['t', 'x'])
    >>> _names_of_form(("x:", ",", "y:", ",", "")) is None  # decimal commas
    True
    """
    if "," in form[1:-1] or not re.search(r"[^\s,;|]", "".join(form)):
        return None
    # What a comma parts from the number behind it is no name: `$ACC,0.1`.
    whole = [re.sub(r"[^\s,;]+,\s*$", "", form[0]), *form[1:]]
    words = [re.findall(r"[^\s,;:=\"'{}\[\]()|*]+|[:=]", between) for between in whole]
    names = []
    for before, behind in pairwise(words):
        named = [word for word in before if re.search(r"\w", word)]
        alone = len(behind) == 1 or (behind and behind[1] not in ":=")
        unit = behind.pop(0) if alone and unit_of_label(behind[0]) else ""
        names.append(" ".join(named) + (f" ({unit})" if unit else ""))
    if any(re.search(r"\w", word) for word in words[-1]):
        return None
    return [name or f"column {k}" for k, name in enumerate(names)] if any(names) else names


class TextSource(Source):
    """Text of one row a sample: a file, or what was laid aside from one.

    Parameters
    ----------
    path : Path
        The file, for messages.
    aside, text : optional
        What is read instead, and where: gone when it is closed.
    called : Lines
        What its lines are called in the file.
    layout : Layout, optional
        Where it is known.
    """

    format: str = "text"

    def __init__(
        self,
        path: Path,
        aside: IO[bytes] | None = None,
        text: Path | None = None,
        called: Lines = THE_FILE,
        *,
        layout: Layout | None = None,
    ) -> None:
        self.path, self._aside, self._text = path, aside, text or path
        self.called = called
        self.layout = layout = layout or find_layout(self._text, called)
        self.columns = layout.columns
        if layout.behind:
            more, shown = counted(len(layout.behind), "line"), f"('{layout.behind[0][:60]}')"
            self.losses = (
                f"it ends within a row {shown}, which is left out: the file may have been cut; "
                "copy it again"
                if layout.cut
                else f"{more} after the last row hold no data {shown}",
            )
            with self._text.open("rb") as stream:  # of which these lines are left out
                read = iter(lambda: stream.read(min(_CHUNK, layout.end - stream.tell())), b"")
                self._aside, self._text = laid_aside(read)
        self._first_stamps: dict[int, str] = {}
        self.time_column, self.stated_rows = layout.time_column, layout.stated.rows
        self.sample_interval, self.start = layout.stated.interval, layout.stated.start
        self.unpaired = layout.unpaired
        if len(self.columns) == 1 and self.columns[0].name == CODED:  # GW Instek
            cells = [layout.cells(line)[0] for _, line in islice(self._rows(), 100)]
            if all(cell.lstrip("+-").isdecimal() for cell in cells):
                self.columns = (replace(self.columns[0], unit=CODES),)

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """Blocks of the given columns; see `Source.blocks`."""
        wanted = sorted(set(columns))
        order = [wanted.index(column) for column in columns]
        for first, lines in self._pieces(rows):
            self._require_whole(first, lines)
            block = self._fast(wanted, lines)
            if block is None:
                block = self._patient(wanted, self._filled(first, lines))
            if len(block):
                yield block[:, order]

    def locate(self, row: int) -> str:
        """``"line 12"``, counted as an editor counts; blank lines between rows are no rows."""
        found = next(islice(self._rows(), row, None), None)
        return self.called.at(found[0]) if found else f"row {row}"

    def _rows(self) -> Iterator[tuple[int, str]]:
        """Line number (from 1) and text of every row of data."""
        for first, lines in self._pieces(BLOCK_ROWS):
            yield from self._filled(first, lines)

    def _pieces(self, rows: int) -> Iterator[tuple[int, list[str]]]:
        """The lines from the first row of data on, so many at once, and the number of the first."""
        done = self.layout.first
        with self._text.open(encoding=self.layout.encoding, errors="replace") as stream:
            for _ in islice(stream, done):
                pass
            while lines := list(islice(stream, rows)):
                yield done + 1, lines
                done += len(lines)

    def _filled(self, first: int, lines: Sequence[str]) -> list[tuple[int, str]]:
        blank = " \n" if self.layout.delimiter == "\t" else " \t\n"
        return [
            (n, line)
            for n, line in enumerate(lines, first)
            if line.strip(blank) and not is_remark(self.layout, line)
        ]

    def _require_whole(self, first: int, lines: Sequence[str]) -> None:
        """Refuse the first row that is not what its neighbours are: read as it stands, a cell too
        many, an open quote or zero bytes would shift numbers, without a word."""
        sign, width = self.layout.delimiter, self.layout.width
        if sign is None:
            cells = [len(line.split()) for line in lines]
        else:
            cells = [line.count(sign) + 1 for line in lines]
        text = "".join(lines)
        if max(cells) <= width and '"' not in text and "\0" not in text:
            return
        for line, count, number in zip(lines, cells, range(first, first + len(lines)), strict=True):
            where, word = self.called.at(number), self.called.word
            if "\0" in line:
                raise RecordError(
                    "zero bytes in the text, as a logger leaves them when its power fails; cut the "
                    f"file before this {word}",
                    where=where,
                )
            if line.count('"') % 2:
                raise RecordError(f"a quote that is not closed; correct the {word}", where=where)
            found = self.layout.cells(line) if count > width else []
            if any(cell and self.layout.is_number(cell) for cell in found[width:]):
                raise RecordError(
                    f"{len(found)} cells where the rows have {width} ('{line.strip()[:60]}'); "
                    f"correct the {word}, or, if the numbers have decimal commas, export with "
                    "another delimiter",
                    where=where,
                )

    def _fast(self, wanted: list[int], lines: Sequence[str]) -> FloatArray | None:
        """Rows as the compiled reader gives them; None where it finds a word among numbers."""
        import pandas as pd

        layout = self.layout
        if set(wanted) & set(layout.stamps):
            return None
        try:
            found = pd.read_csv(
                StringIO("".join(lines)),
                sep=r"\s+" if layout.delimiter is None else layout.delimiter,
                decimal=layout.decimal,
                header=None,
                names=[f"c{column}" for column in wanted],  # numbers would mean positions
                usecols=wanted,
                index_col=False,
                skipinitialspace=True,
                na_values=_MISSING,
                keep_default_na=False,
                dtype=np.float64,
                engine="c",
            )
        except (ValueError, TypeError, OverflowError, pd.errors.ParserError):
            return None
        whole = len(found) == len(lines) or len(found) == len(self._filled(0, lines))
        return found.to_numpy(dtype=np.float64) if whole else None

    def _patient(self, wanted: list[int], lines: list[tuple[int, str]]) -> FloatArray:
        """Rows cell by cell: words of overload, dates and times of day."""
        rows = [self.layout.cells(line) for _, line in lines]
        block = np.empty((len(rows), len(wanted)))
        for k, column in enumerate(wanted):
            cells = [row[column] if column < len(row) else "" for row in rows]
            name = f"column {self.columns[column].name or column}"
            if column in self.layout.stamps:
                filled = next((cell for cell in cells if cell), "")
                first = self._first_stamps.setdefault(column, filled)
                try:
                    block[:, k] = seconds_since(cells, first)
                except ParameterError as error:
                    where = f"{self.called.at(lines[0][0])} or below, {name}"
                    raise RecordError(error.problem, where=where) from None
                continue
            for i, cell in enumerate(cells):
                block[i, k] = self._value(cell, f"{self.called.at(lines[i][0])}, {name}")
        return block

    def _value(self, cell: str, where: str) -> float:
        if cell in _MISSING:
            return float("nan")
        if number := self.layout.number(cell):
            return float(number)
        if is_overload(cell):
            return overload_value(cell)
        sign = "comma" if self.layout.decimal == "," else "point"
        raise RecordError(
            f"found '{cell[:40]}', expected a number with decimal {sign}; correct the cell or cut "
            "the record",
            where=where,
        )


#: Lines of one block, from 0: its own header, its first row, and the line after its last.
RowBlock = tuple[int, int, int]


def find_blocks(path: Path, layout: Layout) -> list[RowBlock]:
    """The blocks of rows of a text file; none where the file is as most are.

    Lines between rows divide them if they hold words alone, and either are several, or follow a
    blank line, or repeat what stands above the first block, be it counted (``Track 2``): one bad
    row is none of these.
    """
    gaps: dict[int, str] = {}
    total, names = 0, ""
    with path.open(encoding=layout.encoding, errors="replace") as stream:
        for total, line in enumerate(stream, start=1):
            if total <= layout.first:
                names = line
            elif line[0] in _WORDS or line.isspace():
                gaps[total - 1] = line
                if len(gaps) > _LISTED:
                    return []
    between = np.zeros(total, dtype=bool)
    between[list(gaps)] = True
    runs = runs_of(between)
    if len(runs) > _MOST * (total - layout.first):
        return []
    starts: list[tuple[int, int]] = []
    for begin, end in runs:
        words = [gaps[i] for i in range(begin, end) if gaps[i][0] in _WORDS]
        cells = [[cell for cell in layout.cells(text) if cell] for text in words]
        plain = any(row and not any(layout.is_value(cell) for cell in row) for row in cells)
        again = _uncounted(names) and [*map(_uncounted, words)] == [_uncounted(names)]
        if (again or (plain and end - begin > 1)) and end < total:
            starts.append((begin, end))
    bounds = [(layout.first, layout.first), *starts, (total, total)]
    found = [
        (header, first, end)
        for (header, first), (end, _) in pairwise(bounds)
        if end - first >= _FEWEST
    ]
    return found if len(found) > 1 else []


def lines_of_block(path: Path, layout: Layout, block: RowBlock) -> Iterator[str]:
    """A block as a text file of its own: what holds for all, its header, its rows."""
    with path.open(encoding=layout.encoding, errors="replace", newline=None) as stream:
        header, first, end = block
        common = list(islice(stream, layout.first))
        own = list(islice(stream, header - layout.first, first - layout.first))
        own = [line for line in own if line.strip()]
        rows = islice(stream, end - first)
        row = next(rows)
        yield from _merged(layout, common, own, len(layout.cells(row))) if own else common
        yield row
        yield from rows


def _merged(layout: Layout, common: list[str], own: list[str], cells: int) -> list[str]:
    """Lines above the first block that another, of `cells` cells, keeps, and its own."""
    width = min(cells, len([cell for cell in layout.cells(common[-1]) if cell]) if common else 0)
    last = layout.cells(own[-1])
    words = [cell for cell in last if cell]
    # Rows may have empty cells where another block has a column: `Hertz,Ampere,` over `100,0.2,`.
    named = len(words) >= width or (len(last) == cells and len(words) > 1)
    stated = {layout.cells(line)[0] for line in own}
    kept = [line for line in common if not line.strip() or layout.cells(line)[0] not in stated]
    return [*kept, *own] if named else [*own, *kept]


def _uncounted(line: str) -> str:
    """A heading without the number that counts it."""
    return re.sub(r"\d+", "", line).strip()
