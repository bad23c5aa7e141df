"""Text files of oscilloscopes, analysers and data loggers: CSV of any kind, plain columns.

Text files with several blocks of rows one after another, each under lines of its own.

LabVIEW writes a file of several segments so, and programs that append record to record. What
stands above the first block belongs to all of them, but for what a block states itself.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from vinesexp.arrays import FloatArray, runs_of
from vinesexp.errors import ParameterError, RecordError
from vinesexp.records.readers.header import find_layout
from vinesexp.records.readers.labels import CODED, CODES, is_overload, overload_value, unit_of_label
from vinesexp.records.readers.layout import Layout, seconds_since
from vinesexp.records.readers.source import (
    BLOCK_ROWS,
    Column,
    Source,
    file_aside,
    file_of,
    number_of_part,
    part_of,
)

NAME = "text (CSV, TXT, LabVIEW LVM)"

#: What stands for a missing sample; every other word in a cell is a mistake.
_MISSING = ["", "NaN", "nan", "NAN", "-NaN", "-nan"]
_FEWEST = 3  # rows of a block; what follows fewer is a remark
_MOST = 0.2  # stretches of words for each row: more are rows with text in them
_WORDS = np.zeros(256, dtype=bool)
_WORDS[[*range(65, 91), *range(97, 123), *b'#*%"[']] = True
_NUMBERS, _WORDED, _EMPTY = 0, 1, 2  # kinds of lines

# Whether every row of a text file holds the cells it should, before its numbers are trusted.
#
# A row with a cell too many (`0.1,1,5,2` for three columns), a quote that is never closed, or zero
# bytes left by a logger that lost its power would be read as something else, without a word. Two
# passes of plain counting over the bytes find them: 2 ns a byte.
_CHUNK = 1 << 22
_LONGEST = 1 << 20  # bytes of one line; more is no row of numbers
_NEWLINE, _QUOTE, _BLANK = 10, 34, 32
_UTF_16 = (b"\xff\xfe", b"\xfe\xff")  # the mark that such a file begins with


def require_whole_rows(path: Path, layout: Layout) -> int:
    """Count the rows of data, refusing the first that is not what its neighbours are.

    Raises
    ------
    RecordError
        A row with more cells than columns, an unbalanced quote, zero bytes; with the line.
    """
    count = 0
    line = 0
    for chunk in whole_lines(path, layout.end):
        if line >= layout.first and (alike := _lines_alike(chunk, layout)):
            count, line = count + alike, line + alike
            continue
        codes, ends = codes_and_ends(chunk)
        cells, filled, odd = _count(codes, ends, layout)
        lines = np.arange(line, line + len(ends))
        line += len(ends)
        data = lines >= layout.first
        wrong = data & (odd | (cells > layout.width))
        for k in np.flatnonzero(wrong):
            begin = int(ends[k - 1]) + 1 if k else 0
            _judge(layout, chunk[begin : int(ends[k])], int(lines[k]) + 1)
        count += int(np.count_nonzero(data & filled))
    return count


def _lines_alike(chunk: bytes, layout: Layout) -> int:
    """How many lines a piece has, where all hold one number of cells that columns allow; else 0."""
    if layout.delimiter is None or b"\0" in chunk or b'"' in chunk:
        return 0
    codes = np.frombuffer(chunk, np.uint8)
    marks = codes[(codes == ord(layout.delimiter)) | (codes == _NEWLINE)]
    lines = chunk.count(b"\n")
    cells = len(marks) // max(lines, 1)
    even = 1 < cells <= layout.width and len(marks) == cells * lines and chunk.endswith(b"\n")
    return lines if even and (marks[cells - 1 :: cells] == _NEWLINE).all() else 0


def whole_lines(path: Path, end: int = 0) -> Iterator[bytes]:
    """The file in pieces that end with a line; lone carriage returns become line feeds.

    Up to byte `end`, where that is not 0.
    """
    rest = b""
    lone: bool | None = None
    left = end or path.stat().st_size
    with path.open("rb") as stream:
        while chunk := stream.read(min(_CHUNK, left)):
            left -= len(chunk)
            if lone is None:
                lone = b"\n" not in chunk and b"\r" in chunk
            chunk = rest + (chunk.replace(b"\r", b"\n") if lone else chunk)
            cut = chunk.rfind(b"\n") + 1
            rest = chunk[cut:]
            if len(rest) > _LONGEST:
                raise RecordError(
                    "a line of more than a megabyte; export the record as columns of numbers"
                )
            if cut:
                yield chunk[:cut]
    if rest:
        yield rest


def codes_and_ends(chunk: bytes) -> tuple[NDArray[np.uint8], NDArray[np.intp]]:
    """Bytes of a piece of a file as numbers, and where each of its lines ends."""
    codes = np.frombuffer(chunk, np.uint8)
    ends = np.flatnonzero(codes == _NEWLINE)
    if not len(ends) or ends[-1] != len(codes) - 1:
        ends = np.append(ends, len(codes))
    return codes, ends


def _count(
    codes: NDArray[np.uint8], ends: NDArray[np.int64], layout: Layout
) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
    """For every line: its cells, whether it holds any, and whether odd bytes stand in it."""
    solid, quotes = codes > _BLANK, codes == _QUOTE
    if layout.delimiter is None:
        starts = solid.copy()
        starts[1:] &= ~solid[:-1]
        cells = _per_line(starts, ends)
        filled = cells > 0
    else:
        parts = codes == ord(layout.delimiter)
        # The fast reader counts a line of separators as a row; a line of blanks is none.
        filled = _per_line(solid | parts, ends) > 0
        if quotes.any():
            parts &= np.cumsum(quotes) % 2 == 0
        cells = _per_line(parts, ends) + 1
    odd = (_per_line(codes == 0, ends) > 0) | (_per_line(quotes, ends) % 2 == 1)
    return cells, filled, odd


def _per_line(marked: NDArray[np.bool_], ends: NDArray[np.int64]) -> NDArray[np.int64]:
    at = np.searchsorted(np.flatnonzero(marked), ends)
    return np.diff(at, prepend=0)


def _judge(layout: Layout, raw: bytes, line: int) -> None:
    """Refuse a suspicious row, unless only remarks or empty cells are too many."""
    where = f"line {line}"
    if b"\0" in raw:
        raise RecordError(
            "zero bytes in the text, as a logger leaves them when its power fails; cut the file "
            "before this line",
            where=where,
        )
    text = raw.decode(layout.encoding, "replace")
    if text.count('"') % 2:
        raise RecordError("a quote that is not closed; correct the line", where=where)
    cells = layout.cells(text)
    surplus = [cell for cell in cells[layout.width :] if cell]
    if any(layout.is_number(cell) for cell in surplus):
        raise RecordError(
            f"{len(cells)} cells where the rows have {layout.width} ('{text.strip()[:60]}'); "
            "correct the line, or, if the numbers have decimal commas, export with another "
            "delimiter",
            where=where,
        )


def recognises(head: bytes, suffix: str) -> bool:
    """Text has no zero bytes, unless it is UTF-16, which begins with its mark."""
    return head[:2] in _UTF_16 or b"\0" not in head.rstrip(b"\0")


def open_file(path: Path) -> TextSource:
    """Open a text file, or one of its blocks; RecordError where it holds no columns of numbers."""
    file = file_of(path)
    layout = None
    with file.open("rb") as stream:
        wide = stream.read(2) in _UTF_16
    if not wide:
        try:
            layout = find_layout(file)
            bare = not layout.unpaired and not any(column.name for column in layout.columns)
        except RecordError:
            if (laid_aside := _without_words(file, 0)) is None:
                raise
            return AsideSource(file, *laid_aside)
        # Without names above, words in the rows may be the names, and glued to their numbers.
        if bare and (laid_aside := _without_words(file, layout.held)) is not None:
            return AsideSource(file, *laid_aside)
    if layout is not None and (found := find_blocks(file, layout)):
        return BlockSource(path, layout, found)
    if part_of(path):
        raise RecordError("holds one block of rows; leave out the # and what follows it")
    return TextSource(file, layout) if layout is not None else AsideSource(file, *_narrow(file))


def _narrow(file: Path) -> tuple[IO[bytes], Path]:
    """UTF-16 laid aside as UTF-8, of which a line end is one byte and a delimiter another."""
    aside, text = file_aside()
    with file.open(encoding="utf-16", errors="replace", newline="") as stream:
        while piece := stream.read(_CHUNK):
            aside.write(piece.encode("utf-8", "replace"))
    return aside, text


_FIGURE = re.compile(
    r"(?<![\w.^])(?<!\d[:/-])(?:(?:\d{4}-\d\d-\d\d[T ])?\d{1,2}:\d\d:\d\d(?:[.,]\d+)?Z?"
    r"|[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?)(?![\d:/]|\.\d)"
)
_ALIKE = 10  # rows of one form at least


def _without_words(file: Path, least: int) -> tuple[IO[bytes], Path, int] | None:
    """Rows with the same words around their numbers laid aside as columns with names and units.

    ``x:0.12 y:0.3``, ``{"t": 0.1, "x": 2}``, ``(0.1, 2)``, ``0.1 s, 2 mm``. None where most rows
    are not alike, or have no more numbers than `least`. What stands above them is kept; a row of
    another form among them is refused.
    """
    with file.open(encoding="utf-8", errors="replace") as stream:
        head = Counter(_form(line) for line in islice(stream, 200) if line.strip())
    form, count = max(head.items(), key=lambda item: item[1], default=((), 0))
    alike = count >= _ALIKE and 2 * count > head.total() and len(form) - 1 > least
    names = _names_of_form(form) if alike else None
    if names is None:
        return None
    aside, text = file_aside()
    begun = False
    odd: list[tuple[int, str]] = []
    with file.open(encoding="utf-8", errors="replace") as stream:
        for number, line in enumerate(stream, start=1):
            if _form(line) != form:
                if begun and line.strip():
                    odd.append((number, line))
                else:
                    aside.write(line.encode())
                continue
            if odd:
                raise RecordError(
                    f"found '{odd[0][1].strip()[:60]}', expected words and numbers as in the rows "
                    "above; correct the row",
                    where=f"line {odd[0][0]}",
                )
            if not begun and any(names):
                aside.write(("\t".join(names) + "\n").encode())
            begun = True
            aside.write(("\t".join(_FIGURE.findall(line)) + "\n").encode())
    aside.writelines(f"# {line}".encode() for _, line in odd)  # behind the last row
    return aside, text, -int(any(names))


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
        if len(behind) == 1 or (behind and behind[1] not in ":="):
            unit = behind[0] if unit_of_label(behind[0]) else ""
        else:
            unit = ""
        if unit:
            behind.pop(0)
        names.append(" ".join(named) + (f" ({unit})" if unit else ""))
    if any(re.search(r"\w", word) for word in words[-1]):
        return None
    return [name or f"column {k}" for k, name in enumerate(names)] if any(names) else names


class TextSource(Source):
    """A text file: one row a sample."""

    format: str = "text"

    def __init__(self, path: Path, layout: Layout | None = None) -> None:
        self.path = path  # for messages
        self._read_from = path
        self.layout: Layout = layout or find_layout(path)
        self.columns: tuple[Column, ...] = self.layout.columns
        self._rows_found: int | None = None
        if self.layout.behind:
            count = len(self.layout.behind)
            shown = f"('{self.layout.behind[0][:60]}')"
            self.losses = (
                f"it ends within a row {shown}, which is left out: the file may have been cut; "
                "copy it again"
                if self.layout.cut
                else f"{count} line{'s' * (count > 1)} after the last row hold no data {shown}",
            )
        self._first_stamps: dict[int, str] = {}
        self.time_column, self.stated_rows = self.layout.time_column, self.layout.rows
        self.sample_interval, self.start = self.layout.interval, self.layout.start
        if len(self.columns) == 1 and self.columns[0].name == CODED:  # GW Instek
            cells = [self.layout.cells(line)[0] for _, line in islice(self._rows(), 100)]
            if all(cell.lstrip("+-").isdecimal() for cell in cells):
                self.columns = (replace(self.columns[0], unit=CODES),)

    @property
    def unpaired(self) -> str:
        """Why the names of the file cannot be paired with its columns; empty where they are."""
        return self.layout.unpaired

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """Blocks of the given columns; see `Source.blocks`."""
        if self._rows_found is None:
            self._rows_found = require_whole_rows(self._read_from, self.layout)
        wanted = sorted(set(columns))
        order = [wanted.index(column) for column in columns]
        done = 0
        for block in self._fast(wanted, rows):
            if block is None:
                break
            done += len(block)
            yield block[:, order]
        else:
            if done != self._rows_found:
                raise RecordError(
                    f"{self._rows_found} rows, of which {done} could be read; export the record "
                    "again without quotes"
                )
            return
        for block in self._patient(wanted, done, rows):
            yield block[:, order]

    def locate(self, row: int) -> str:
        """``"line 12"``, counted as an editor counts; blank lines between rows are no rows."""
        found = next(islice(self._rows(), row, None), None)
        return f"line {found[0]}" if found else f"row {row}"

    def _fast(self, wanted: list[int], rows: int) -> Iterator[FloatArray | None]:
        """Blocks as the compiled reader gives them; None where it finds a word among numbers."""
        import pandas as pd

        layout = self.layout
        if set(wanted) & set(layout.stamps):
            yield None
            return
        try:
            with pd.read_csv(
                self._read_from,
                sep=r"\s+" if layout.delimiter is None else layout.delimiter,
                decimal=layout.decimal,
                encoding=layout.encoding,
                encoding_errors="replace",
                compression=None,  # what the name ends with says nothing
                header=None,
                names=[f"c{column}" for column in wanted],  # numbers would mean positions
                usecols=wanted,
                nrows=self._rows_found,
                index_col=False,
                skiprows=layout.first,
                skipinitialspace=True,
                na_values=_MISSING,
                keep_default_na=False,
                dtype=np.float64,
                engine="c",
                chunksize=rows,
            ) as reader:
                for chunk in reader:
                    yield chunk.to_numpy(dtype=np.float64)
        except (ValueError, TypeError, OverflowError, pd.errors.ParserError):
            yield None

    def _patient(self, wanted: list[int], done: int, rows: int) -> Iterator[FloatArray]:
        """Blocks from row `done` on, cell by cell: words of overload, dates and times of day."""
        lines: list[tuple[int, list[str]]] = []
        for number, line in islice(self._rows(), done, self._rows_found):
            lines.append((number, self.layout.cells(line)))
            if len(lines) == rows:
                yield self._values(wanted, lines)
                lines = []
        if lines:
            yield self._values(wanted, lines)

    def _values(self, wanted: list[int], lines: list[tuple[int, list[str]]]) -> FloatArray:
        block = np.empty((len(lines), len(wanted)))
        for k, column in enumerate(wanted):
            cells = [row[column] if column < len(row) else "" for _, row in lines]
            if column in self.layout.stamps:
                first = self._first_stamps.setdefault(
                    column, next((cell for cell in cells if cell), "")
                )
                try:
                    block[:, k] = seconds_since(cells, first)
                except ParameterError as error:
                    where = f"{self.locate(0)} or below, column {self._name(column)}"
                    raise RecordError(error.problem, where=where) from None
                continue
            for i, cell in enumerate(cells):
                block[i, k] = self._value(cell, lines[i][0], column)
        return block

    def _value(self, cell: str, line: int, column: int) -> float:
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
            where=f"line {line}, column {self._name(column)}",
        )

    def _name(self, column: int) -> str:
        return self.columns[column].name or str(column)

    def _rows(self) -> Iterator[tuple[int, str]]:
        """Line number (from 1) and text of every row of data."""
        blank = " " if self.layout.delimiter == "\t" else " \t"
        with self._read_from.open(encoding=self.layout.encoding, errors="replace") as stream:
            for number, line in enumerate(stream, start=1):
                line = line.rstrip("\n")
                if number > self.layout.first and line.strip(blank):
                    yield number, line


class AsideSource(TextSource):
    """Text that a reader laid aside (`file_aside`); what is said of it names where it is from."""

    def __init__(self, path: Path, aside: IO[bytes], text: Path, shift: int = 0) -> None:
        aside.flush()
        self._shift = shift  # of its lines
        self._aside = aside  # what is aside is gone when it is closed
        try:
            super().__init__(text)
        except RecordError as error:
            raise self._meant(error) from None
        self._read_from, self.path = self.path, path

    def blocks(self, columns: Sequence[int], rows: int = BLOCK_ROWS) -> Iterator[FloatArray]:
        """Blocks of the given columns; see `Source.blocks`."""
        try:
            yield from super().blocks(columns, rows)
        except RecordError as error:
            raise self._meant(error) from None

    def locate(self, row: int) -> str:
        """Where row `row` stands in what the text is from."""
        return self._placed(super().locate(row))

    def _placed(self, where: str) -> str:
        """``"line 120"`` of the text as the line of what it is from."""
        return re.sub(r"(?<=line )\d+", lambda found: str(int(found[0]) + self._shift), where)

    def _meant(self, error: RecordError) -> RecordError:
        where = self._placed(error.where) if error.where else None
        return RecordError(error.problem, where=where)


class BlockSource(AsideSource):
    """One of several blocks of a text file, the first where none is named."""

    def __init__(self, path: Path, layout: Layout, blocks: Sequence[RowBlock]) -> None:
        file = file_of(path)
        block = blocks[number_of_part(path, len(blocks), "blocks of rows")]
        aside, text = file_aside()
        aside.writelines(line.encode() for line in lines_of_block(file, layout, block))
        super().__init__(path, aside, text)
        self._shift = block.first - self.layout.first
        self.parts = tuple(str(k + 1) for k in range(len(blocks)))


@dataclass(frozen=True)
class RowBlock:
    """Lines of one block, from 0: its own header, its first row, and the line after its last."""

    header: int
    first: int
    end: int


def find_blocks(path: Path, layout: Layout) -> list[RowBlock]:
    """The blocks of rows of a text file; one where the file is as most are.

    Lines between rows divide them if they hold words alone, and either are several, or follow a
    blank line, or repeat what stands above the first block, be it counted (``Track 2``): one bad
    row is none of these.
    """
    kinds = _kinds_of_lines(path)
    total = len(kinds)
    kinds[: layout.first] = _NUMBERS
    after = np.flatnonzero(kinds == _WORDED)
    gaps = list(runs_of(kinds != _NUMBERS))
    if not len(after) or len(gaps) > _MOST * (total - layout.first):
        return []
    wanted = {layout.first - 1, *after.tolist()}
    with path.open(encoding=layout.encoding, errors="replace") as stream:
        texts = {i: line for i, line in enumerate(stream) if i in wanted}
    names = texts.get(layout.first - 1, "")
    starts: list[tuple[int, int]] = []
    for begin, end in gaps:
        words = [texts[i] for i in range(begin, end) if i in texts]
        cells = [[cell for cell in layout.cells(text) if cell] for text in words]
        plain = any(row and not any(layout.is_value(cell) for cell in row) for row in cells)
        again = bool(_uncounted(names)) and [_uncounted(text) for text in words] == [
            _uncounted(names)
        ]
        if (again or (plain and end - begin > 1)) and end < total:
            starts.append((begin, end))
    bounds = [(layout.first, layout.first), *starts, (total, total)]
    found = [
        RowBlock(bounds[k][0], bounds[k][1], bounds[k + 1][0])
        for k in range(len(bounds) - 1)
        if bounds[k + 1][0] - bounds[k][1] >= _FEWEST
    ]
    return found if len(found) > 1 else []


def lines_of_block(path: Path, layout: Layout, block: RowBlock) -> Iterator[str]:
    """A block as a text file of its own: what holds for all, its header, its rows."""
    with path.open(encoding=layout.encoding, errors="replace", newline=None) as stream:
        common = list(islice(stream, layout.first))
        own = list(islice(stream, block.header - layout.first, block.first - layout.first))
        own = [line for line in own if line.strip()]
        if block.header > layout.first:
            yield from _merged(layout, common, own)
        else:
            yield from common
        yield from islice(stream, block.end - block.first)


def _merged(layout: Layout, common: list[str], own: list[str]) -> list[str]:
    """Lines above the first block that another one does not state anew, and its own."""
    width = len([cell for cell in layout.cells(common[-1]) if cell]) if common else 0
    named = bool(own) and len([cell for cell in layout.cells(own[-1]) if cell]) >= width
    stated = {layout.cells(line)[0] for line in own}
    kept = [line for line in common if not line.strip() or layout.cells(line)[0] not in stated]
    return [*kept, *own] if named else [*own, *kept]


def _uncounted(line: str) -> str:
    """A heading without the number that counts it."""
    return re.sub(r"\d+", "", line).strip()


def _kinds_of_lines(path: Path) -> NDArray[np.uint8]:
    """Which lines begin with a letter or a mark, and which are blank."""
    found = [np.zeros(0, np.uint8)]
    for chunk in whole_lines(path):
        codes = np.frombuffer(chunk, np.uint8)
        first = np.append(codes[:1], codes[1:][codes[:-1] == _NEWLINE])
        kinds = np.where(_WORDS[first], _WORDED, _NUMBERS).astype(np.uint8)
        if (first <= _BLANK).any():
            ends = codes_and_ends(chunk)[1]
            begins = np.concatenate(([0], ends[:-1] + 1))
            for k in np.flatnonzero((first <= _BLANK) & (ends - begins <= 4)):
                if not chunk[int(begins[k]) : int(ends[k])].strip():
                    kinds[k] = _EMPTY
        found.append(kinds)
    return np.concatenate(found)
